# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The service: camera and server together, watched, reloaded and stopped by systemd."""

import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from firmware_pi.camera import PiCamera, Take
from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer
from firmware_pi.settings import Settings, read_settings
from firmware_pi.systemd import notify, watchdog_s
from sensor.errors import WedgeError

FIRST_FRAME_WITHIN_S = 20.0
STALLED_AFTER_S = 3.0
LOOK_EVERY_S = 1.0


class Camera(Protocol):
    """Gives frames from when it is made until it is stopped."""

    def report(self) -> dict[str, Any]:
        """What the camera is and what it uses."""

    def stop(self) -> None:
        """Give no further frame."""


OpenCamera = Callable[[Settings, Take], Camera]


class Service:
    """One camera and its server.

    Args:
        file: The settings file; read again upon SIGHUP.
        credentials: "user:password" that clients must bring, if any.
        open_camera: Opens the camera.

    Raises:
        WedgeError: the settings, the camera or the port are not as they must be.
    """

    def __init__(
        self, file: Path, credentials: str | None = None, open_camera: OpenCamera = PiCamera
    ) -> None:
        self._file = file
        self._open = open_camera
        self._newest = Newest()
        self._wake = threading.Event()
        self._stop = self._reload = False
        self.settings = read_settings(file)
        self.server = StreamServer(
            self.settings.address,
            self.settings.port,
            self._newest,
            self.describe,
            max_clients=self.settings.max_clients,
            credentials=credentials,
        )
        self._camera: Camera | None = None
        try:
            self._camera = open_camera(self.settings, self._newest.put)
        except BaseException:
            self.server.server_close()
            raise

    def describe(self) -> dict[str, Any]:
        """What was asked of the camera and what it used."""
        camera = self._camera
        return {"asked": asdict(self.settings), "used": camera.report() if camera else {}}

    def run(self) -> None:
        """Serve until SIGTERM or SIGINT.

        Raises:
            WedgeError: the camera gives no first frame, or takes neither new settings nor, after
                them, the old ones.
        """
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(number, self._on_signal)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        try:
            self._await_first_frame()
            if not self._stop:
                notify("READY=1", f"STATUS=streaming at {self.settings.address}")
                self._look_after()
        finally:
            notify("STOPPING=1")
            self.server.stop()
            self._stop_camera()

    def _await_first_frame(self) -> None:
        """Wait for a frame, or for a signal to stop: the wait is cut into slices to see it."""
        end_s = time.monotonic() + FIRST_FRAME_WITHIN_S
        while not self._stop and self._newest.after(-1, LOOK_EVERY_S) is None:
            if time.monotonic() > end_s:
                raise WedgeError(
                    f"camera {self.settings.camera} gives no frame: check its ribbon's contacts."
                )

    def _look_after(self) -> None:
        """Tell systemd that frames come, as long as they do: it restarts us when they stop."""
        every_s = min(LOOK_EVERY_S, (watchdog_s() or LOOK_EVERY_S * 3) / 3)
        while not self._stop:
            if self._reload:
                self._reload = False
                self._read_again()
            rate = self._newest.rate_hz
            if self._newest.age_s < STALLED_AFTER_S:
                notify("WATCHDOG=1", f"STATUS={rate or 0:.1f} Hz, {self.server.clients} clients")
            else:
                notify(f"STATUS=no frame for {self._newest.age_s:.0f} s")
            self._wake.wait(every_s)
            self._wake.clear()

    def _read_again(self) -> None:
        """Take new settings; where they are wrong or the camera refuses them, the old ones stay.

        Raises:
            WedgeError: the camera does not take the old ones again either.
        """
        usec = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        notify("RELOADING=1", f"MONOTONIC_USEC={usec}")
        before = self.settings
        try:
            after = read_settings(self._file)
        except WedgeError as error:
            refused: WedgeError | None = error
        else:
            refused = self._switch(after)
            served = (before.address, before.port, before.max_clients)
            if not refused and served != (after.address, after.port, after.max_clients):
                _say("address, port and max_clients hold from the next restart on.")
        if refused:
            _say(f"{refused} The settings from before stay.")
        notify("READY=1")

    def _switch(self, after: Settings) -> WedgeError | None:
        """Have the camera take settings; why it does not, where it goes on with those from before.

        Raises:
            WedgeError: it does not, so that there is no camera any more. systemd then starts us
                anew, as after a ribbon that came off.
        """
        self._stop_camera()
        try:
            self._camera = self._open(after, self._newest.put)
        except WedgeError as refused:
            try:
                self._camera = self._open(self.settings, self._newest.put)
            except WedgeError as lost:
                raise WedgeError(f"{refused} Nor do the settings from before do: {lost}") from lost
            return refused
        self.settings = after
        return None

    def _stop_camera(self) -> None:
        """Stop the camera once, even where stopping it fails."""
        camera, self._camera = self._camera, None
        if camera:
            camera.stop()

    def _on_signal(self, number: int, _frame: object) -> None:
        if number == signal.SIGHUP:
            self._reload = True
        else:
            self._stop = True
        self._wake.set()


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)
