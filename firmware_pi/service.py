# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The service: camera and server together, watched, reloaded and stopped by systemd."""

import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Protocol

from firmware_pi.camera import PiCamera, Take
from firmware_pi.interfaces import is_up
from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer
from firmware_pi.settings import Settings, read_settings
from firmware_pi.systemd import notify, watchdog_s
from sensor.errors import WedgeError

FIRST_FRAME_WITHIN_S = 20.0
STALLED_AFTER_S = 3.0
LOOK_EVERY_S = 1.0
STOP_WITHIN_S = 0.05
OF_THE_SERVER = ("address", "port", "max_clients")
"""Settings that it keeps until it is made anew."""


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
        WedgeError: the settings or the port are not as they must be.
    """

    def __init__(
        self, file: Path, credentials: str | None = None, open_camera: OpenCamera = PiCamera
    ) -> None:
        self._file = file
        self._open = open_camera
        self._newest = Newest()
        self._wake = threading.Event()
        self._stop = self._reload = False
        self._look_every_s = min(LOOK_EVERY_S, (watchdog_s() or LOOK_EVERY_S * 3) / 3)
        self._camera: Camera | None = None
        self._refused: WedgeError | None = None
        self._up = True
        self.settings = read_settings(file)
        self.server = StreamServer(
            self.settings.address,
            self.settings.port,
            self._newest,
            self.describe,
            max_clients=self.settings.max_clients,
            credentials=credentials,
            before_up=True,
        )

    def describe(self) -> dict[str, Any]:
        """What was asked of the camera, what it used, and why newer settings were refused."""
        camera = self._camera
        return {
            "asked": asdict(self.settings),
            "used": camera.report() if camera else {},
            "refused": self._refused and str(self._refused),
        }

    def run(self) -> None:
        """Serve until SIGTERM or SIGINT.

        Raises:
            WedgeError: the camera does not open or gives no first frame, with its first settings
                or, after new ones, with the old ones.
        """
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            signal.signal(number, self._on_signal)
        serve = self.server.serve_forever
        threading.Thread(target=serve, args=(STOP_WITHIN_S,), daemon=True).start()
        try:
            self._take_up(self.settings, "STATUS=waiting for the first frame")
            if not self._stop:
                notify("READY=1")
                self._look_after()
        finally:
            notify("STOPPING=1")
            self.server.stop()
            self._stop_camera()

    def _take_up(self, settings: Settings, meanwhile: str) -> None:
        """Open the camera and wait for its first frame, or for a signal to stop.

        Args:
            settings: What to tell the camera.
            meanwhile: What systemd is told while the frame is awaited.

        Raises:
            WedgeError: the camera does not open or gives no frame; it is closed again.
        """
        last = self._newest.count - 1
        self._camera = self._open(settings, self._newest.put)
        end_s = time.monotonic() + FIRST_FRAME_WITHIN_S
        while not self._stop and self._newest.after(last, self._look_every_s) is None:
            if time.monotonic() > end_s:
                self._stop_camera()
                raise WedgeError(
                    f"camera {settings.camera_called} gives no frame: check the settings and its "
                    "ribbon's contacts."
                )
            notify(meanwhile)

    def _look_after(self) -> None:
        """Report to systemd while frames arrive: it restarts us when they stop."""
        while not self._stop:
            if self._reload:
                self._reload = False
                self._read_again()
            where = self._where()
            if self._newest.age_s < STALLED_AFTER_S:
                rate = f"{self._newest.rate_hz or 0:.1f} Hz"
                notify("WATCHDOG=1", f"STATUS={rate}, {self.server.clients} clients {where}")
            else:
                notify(f"STATUS=no frame for {self._newest.age_s:.0f} s")
            self._wake.wait(self._look_every_s)
            self._wake.clear()

    def _where(self) -> str:
        """Where the stream is, or that nobody reaches it: once, the log is told that too."""
        address, was_up = self.settings.address, self._up
        self._up = is_up(address)
        if self._up:
            return f"at {address}"
        if was_up:
            _say(
                f"no interface has the address {address}: nobody reaches the stream until one has. "
                f"If it is not the USB cable's, set address in {self._file} to one that "
                "`hostname -I` names, and restart the service."
            )
        return f"at {address}, which no interface has"

    def _read_again(self) -> None:
        """Take new settings; where they are wrong or bring no frame, the old ones stay.

        Raises:
            WedgeError: the old ones bring none any more either.
        """
        usec = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        notify("RELOADING=1", f"MONOTONIC_USEC={usec}")
        try:
            asked = read_settings(self._file)
        except WedgeError as error:
            self._refused = error
        else:
            served = {key: getattr(self.settings, key) for key in OF_THE_SERVER}
            after = replace(asked, **served)
            self._refused = self._switch(after)
            if not self._refused and after != asked:
                _say("address, port and max_clients take effect at the next restart.")
        if self._refused:
            _say(f"{self._refused} The old settings stay in use.")
        notify("READY=1")

    def _switch(self, after: Settings) -> WedgeError | None:
        """Have the camera take settings; why it does not, where it goes on with those from before.

        Each may take longer than systemd's watchdog waits, which is kept quiet meanwhile.

        Raises:
            WedgeError: it does not go on, so that there is no camera any more. systemd then
                restarts us, as after a ribbon that came off.
        """
        self._stop_camera()
        try:
            self._take_up(after, "WATCHDOG=1")
        except WedgeError as refused:
            try:
                self._take_up(self.settings, "WATCHDOG=1")
            except WedgeError as lost:
                raise WedgeError(
                    f"{refused} The old settings do not work any more either: {lost}"
                ) from lost
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
