# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The service as systemd runs it: a process that says it is ready, reloads, and stops."""

import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_pi import service
from firmware_pi.camera import Take
from firmware_pi.newest import Newest
from firmware_pi.settings import Settings, write_settings
from sensor.errors import WedgeError
from tests.firmware_pi.conftest import FAKE_PI

ROOT = Path(__file__).parents[2]
WITHIN_S = 30


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port: int = free.getsockname()[1]
    return port


class Process:
    """`gelsight-wedge serve` with a stand-in camera, and what it tells systemd."""

    def __init__(self, folder: Path, fake_pi: str = "zero", watchdog_us: int = 300_000) -> None:
        self.file = folder / "0.toml"
        if not self.file.exists():
            write_settings(self.file, Settings(port=free_port(), rate_hz=50))
        self._port = int(self.file.read_text().partition("port = ")[2].split()[0])
        self._told = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._told.settimeout(WITHIN_S)
        self._told.bind(str(folder / "notify"))
        self.child = subprocess.Popen(
            [sys.executable, "-m", "firmware_pi", "serve", str(self.file)],
            cwd=ROOT,
            env={
                **os.environ,
                "PYTHONPATH": str(FAKE_PI),
                "FAKE_PI": fake_pi,
                "NOTIFY_SOCKET": str(folder / "notify"),
                "WATCHDOG_USEC": str(watchdog_us),
            },
            stderr=subprocess.PIPE,
            text=True,
        )

    def until_told(self, *states: str) -> list[str]:
        """Wait until systemd is told one of some states; gives what it was told until then."""
        told: list[str] = []
        while not any(line.startswith(states) for line in told):
            told += self._told.recv(4096).decode().splitlines()
        return told

    def get(self, path: str) -> Any:
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=WITHIN_S)
        connection.request("GET", path)
        answer = connection.getresponse().read()
        connection.close()
        return json.loads(answer)

    def end(self) -> str:
        """Wait for the end; gives what was said."""
        _, said = self.child.communicate(timeout=WITHIN_S)
        return said

    def close(self) -> None:
        self.child.kill()
        self.child.communicate()
        self._told.close()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Any]:
    made = []

    def start(**more: Any) -> Process:
        made.append(Process(tmp_path, **more))
        return made[-1]

    yield start
    for process in made:
        process.close()


@pytest.fixture
def handlers() -> Iterator[None]:
    """Keeps the handlers of the signals that the service takes for itself."""
    kept = {n: signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)}
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


def test_it_is_ready_with_the_first_frame_and_stops_when_told(start: Any) -> None:
    process = start()
    assert "WATCHDOG=1" not in process.until_told("READY=1")
    process.until_told("WATCHDOG=1")
    document = process.get("/settings")
    assert document["asked"]["exposure_us"] == Settings().exposure_us
    assert document["used"]["model"] == "ov5647"
    assert process.get("/health")["fresh"]
    process.child.send_signal(signal.SIGTERM)
    process.until_told("STOPPING=1")
    assert process.end() == ""
    assert process.child.returncode == 0


def test_a_camera_that_stops_is_no_longer_vouched_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, handlers: None
) -> None:
    told: list[str] = []
    fresh: list[bool] = []

    def opened(settings: Settings, take: Take) -> Any:
        take(b"the only one", time.clock_gettime_ns(time.CLOCK_BOOTTIME))
        return SimpleNamespace(report=dict, stop=lambda: None)

    def notify(*states: str) -> None:
        told.extend(states)
        fresh.append(served.server.fresh)
        if "WATCHDOG=1" in states:
            monkeypatch.setattr(Newest, "age_s", 4.0)
        if fresh[-2:] == [False, False]:
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(service, "notify", notify)
    monkeypatch.setattr(service, "LOOK_EVERY_S", 0.01)
    monkeypatch.setattr(Newest, "age_s", 0.0)
    write_settings(tmp_path / "0.toml", Settings(port=free_port()))
    served = service.Service(tmp_path / "0.toml", None, opened)
    served.run()
    no_frame = "STATUS=no frame for 4 s"
    assert [told[0], told[1], *told[3:]] == [
        "READY=1", "WATCHDOG=1", no_frame, no_frame, "STOPPING=1",
    ]  # fmt: skip


def test_new_settings_are_taken_and_wrong_ones_refused_by_name(start: Any) -> None:
    process = start()
    process.until_told("READY=1")
    right = process.file.read_text()

    def reload(text: str) -> Any:
        process.file.write_text(text)
        process.child.send_signal(signal.SIGHUP)
        process.until_told("RELOADING=1")
        process.until_told("READY=1")
        return process.get("/settings")["asked"]

    exposure = f"exposure_us = {Settings().exposure_us}"
    assert reload(right.replace(exposure, "exposure_us = 4000"))["exposure_us"] == 4000
    for wrong in ("exposure_su = 1", "exposure_us = ", "camera = 2", "rate_hz = 1000"):
        assert reload(wrong)["exposure_us"] == 4000
    frames = process.get("/health")["frames"]
    while process.get("/health")["frames"] <= frames:  # the camera goes on
        pass
    process.child.send_signal(signal.SIGTERM)
    said = process.end().splitlines()
    assert [next(key for key in KEYS if key in line) for line in said] == KEYS
    assert all(line.endswith("The old settings stay in use.") for line in said)


def test_what_is_told_of_the_server_is_what_it_was_made_with(start: Any) -> None:
    process = start()
    process.until_told("READY=1")
    served = process.file.read_text()
    elsewhere = served.replace(f"port = {process._port}", f"port = {process._port // 2}")
    for written in (
        elsewhere,
        served.replace("max_clients = 4", "max_clients = 5"),
        elsewhere.replace("red_gain = 1.5", "red_gain = 2.5"),
        served,
    ):
        process.file.write_text(written)
        process.child.send_signal(signal.SIGHUP)
        process.until_told("RELOADING=1")
        process.until_told("READY=1")
        asked = process.get("/settings")["asked"]
        assert (asked["port"], asked["max_clients"]) == (process._port, 4)
    process.child.send_signal(signal.SIGTERM)
    said = process.end().splitlines()
    assert said == 3 * ["address, port and max_clients take effect at the next restart."]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it does not start")
@pytest.mark.parametrize("has_it", [True, False])
def test_an_address_that_no_interface_has_is_said_once(
    start: Any, tmp_path: Path, has_it: bool
) -> None:
    address = "127.0.0.1" if has_it else "198.51.100.1"
    write_settings(tmp_path / "0.toml", Settings(address=address, port=free_port(), rate_hz=50))
    process = start()
    process.until_told("READY=1")
    for _ in range(3):
        status = process.until_told("STATUS=")[-1]
        assert (f"at {address}, which no interface has" in status) is not has_it
    process.child.send_signal(signal.SIGTERM)
    said = process.end().splitlines()
    assert len(said) == (not has_it)
    assert has_it or said[0].startswith(f"no interface has the address {address}: ")


KEYS = ["exposure_su", "not valid TOML", "camera = 2", "rate_hz"]


@pytest.mark.parametrize("why", ["unfit", "stuck"])
def test_a_camera_that_refuses_new_settings_goes_on_with_the_old(start: Any, why: str) -> None:
    process = start(fake_pi=f"zero {why} second")
    process.until_told("READY=1")
    process.file.write_text(process.file.read_text().replace("exposure_us = 1", "exposure_us = 2"))
    process.child.send_signal(signal.SIGHUP)
    process.until_told("RELOADING=1")
    process.until_told("READY=1")
    assert process.get("/settings")["asked"]["exposure_us"] == Settings().exposure_us
    frames = process.get("/health")["frames"]
    while process.get("/health")["frames"] <= frames:
        pass
    process.child.send_signal(signal.SIGTERM)
    said = process.end()
    assert (process.child.returncode, said.count("\n")) == (0, 1)
    assert said.endswith("The old settings stay in use.\n")


@pytest.mark.parametrize("why", ["unfit", "stuck"])
def test_where_the_old_settings_fail_too_it_says_so_and_ends_for_systemd_to_restart(
    start: Any, why: str
) -> None:
    process = start(fake_pi=f"zero {why} later")
    process.until_told("READY=1")
    process.file.write_text(process.file.read_text().replace("exposure_us = 1", "exposure_us = 2"))
    process.child.send_signal(signal.SIGHUP)
    process.until_told("RELOADING=1")
    assert "READY=1" not in process.until_told("READY=1", "STOPPING=1")
    said = process.end()
    assert (process.child.returncode, said.count("\n")) == (2, 1)
    assert "The old settings do not work any more either" in said
    assert "stay" not in said


def test_the_wait_for_a_first_frame_ends_with_a_signal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, handlers: None
) -> None:
    waits_s = []

    class Empty(Newest):
        def after(self, index: int, timeout_s: float) -> None:
            waits_s.append(timeout_s)
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(service, "Newest", Empty)
    write_settings(tmp_path / "0.toml", Settings(port=free_port()))
    camera = SimpleNamespace(stop=lambda: None)
    service.Service(tmp_path / "0.toml", None, lambda *_: camera).run()
    assert waits_s == [service.LOOK_EVERY_S]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a cable is plugged in first")
def test_the_service_listens_before_its_cable_is_plugged_in(tmp_path: Path) -> None:
    write_settings(tmp_path / "0.toml", Settings(address="192.0.2.1", port=free_port()))
    service.Service(tmp_path / "0.toml", None, lambda *_: SimpleNamespace()).server.server_close()


@pytest.mark.parametrize("silent", [{2}, {2, 3}])
def test_new_settings_that_bring_no_frame_give_way_to_the_last_that_did(
    silent: set[int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    handlers: None,
) -> None:
    file = tmp_path / "0.toml"
    before = Settings(port=free_port())
    new = replace(before, exposure_us=4000)
    opened: list[Settings] = []
    streaming: list[int] = []
    told: list[str] = []

    class Camera:
        def __init__(self, settings: Settings, take: Take) -> None:
            assert not streaming  # the one before is closed
            opened.append(settings)
            streaming.append(len(opened))
            if len(opened) in silent:
                return
            take(b"", time.clock_gettime_ns(time.CLOCK_BOOTTIME))
            if len(opened) == 1:
                write_settings(file, new)
                signal.raise_signal(signal.SIGHUP)
            else:
                signal.raise_signal(signal.SIGTERM)

        def report(self) -> dict[str, Any]:
            return {}

        def stop(self) -> None:
            streaming.pop()

    def notify(*states: str) -> None:
        told.extend(states)
        if states[0].startswith("STATUS=no frame"):  # else it would go on so for ever
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(service, "notify", notify)
    monkeypatch.setattr(service, "FIRST_FRAME_WITHIN_S", 0.05)
    monkeypatch.setattr(service, "LOOK_EVERY_S", 0.01)
    write_settings(file, before)
    served = service.Service(file, None, Camera)
    if silent == {2}:
        served.run()
        assert served.describe()["asked"] == asdict(before)
        assert "gives no frame" in served.describe()["refused"]
        assert capsys.readouterr().err.endswith("The old settings stay in use.\n")
    else:
        with pytest.raises(
            WedgeError, match=r"gives no frame.*old settings do not .* gives no frame"
        ):
            served.run()
    assert opened == [before, new, before]
    assert not streaming
    # systemd would have ended it after 10 s of silence, and a camera has longer.
    assert "WATCHDOG=1" in told[told.index("RELOADING=1") :]


def test_it_stops_when_told_while_no_frame_has_come(start: Any) -> None:
    process = start(fake_pi="silent")

    def is_up() -> bool:
        try:
            return process.get("/health")["frames"] == 0
        except ConnectionRefusedError:
            assert process.child.poll() is None
            return False

    while not is_up():
        pass
    process.child.send_signal(signal.SIGTERM)
    assert "READY=1" not in process.until_told("STOPPING=1")
    assert (process.end(), process.child.returncode) == ("", 0)


@pytest.mark.parametrize(
    ("fake_pi", "text", "says"),
    [
        ("none", "", "sees 0"),
        ("busy", "", "resource busy"),
        ("zero", "red_gian = 1.0", "red_gain"),
    ],
)
def test_what_is_wrong_is_one_sentence_and_status_2(
    start: Any, tmp_path: Path, fake_pi: str, text: str, says: str
) -> None:
    (tmp_path / "0.toml").write_text(f"port = {free_port()}\n{text}")
    process = start(fake_pi=fake_pi)
    said = process.end()
    assert process.child.returncode == 2
    assert said.startswith("gelsight-wedge: ")
    assert says in said
    assert said.count("\n") == 1


def test_a_port_in_use_is_one_sentence_and_status_2(start: Any, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        write_settings(tmp_path / "0.toml", Settings(port=taken.getsockname()[1]))
        process = start()
        said = process.end()
    assert process.child.returncode == 2
    assert "another program uses it" in said
    assert said.count("\n") == 1


def test_killed_at_once_it_leaves_the_port_to_the_next(start: Any, tmp_path: Path) -> None:
    process = start()
    process.until_told("READY=1")
    with socket.create_connection(("127.0.0.1", process._port)) as client:
        client.sendall(b"GET /stream.mjpg HTTP/1.1\r\n\r\n")
        assert client.recv(15) == b"HTTP/1.1 200 OK"
        process.child.kill()
        process.child.wait()
        (tmp_path / "notify").unlink()
        start().until_told("READY=1")
