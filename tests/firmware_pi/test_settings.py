# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings survive their file, and a wrong one is refused by name."""

import signal
import subprocess
import sys
import tomllib
from dataclasses import asdict, fields, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_pi.__main__ import main
from firmware_pi.settings import (
    NOISE_REDUCTIONS,
    SYNCS,
    US_PER_S,
    Settings,
    read_settings,
    settings_of,
    settings_text,
    write_settings,
)
from sensor.errors import WedgeError

LIBCAMERA = tomllib.loads((Path(__file__).parent / "libcamera.toml").read_text())

ANY = st.builds(
    lambda rate_hz, share, size_px, **rest: Settings(
        rate_hz=rate_hz,
        exposure_us=max(30, int(share * min(US_PER_S / rate_hz, 66_666))),
        width_px=size_px[0],
        height_px=size_px[1],
        **rest,
    ),
    rate_hz=st.floats(1, 90),
    share=st.floats(0, 1),
    size_px=st.sampled_from([(640, 480), (320, 240)]),
    camera=st.integers(0, 3),
    camera_id=st.sampled_from(["", "/base/axi/pcie@1000120000/rp1/i2c@88000/ov5647@36"]),
    analogue_gain=st.floats(1, 16),
    red_gain=st.floats(0.1, 8),
    blue_gain=st.floats(0.1, 8),
    noise_reduction=st.sampled_from(list(NOISE_REDUCTIONS)),
    sync=st.sampled_from(list(SYNCS)),
    ev=st.integers(-10, 10),
    address=st.sampled_from(["127.0.0.1", "10.55.0.1", "::1"]),
    port=st.integers(1, 65_535),
)


@given(ANY)
def test_settings_survive_their_file(settings: Settings) -> None:
    assert settings_of(tomllib.loads(settings_text(settings))) == settings


@given(ANY)
def test_settings_survive_as_json_values(settings: Settings) -> None:
    assert settings_of(asdict(settings)) == settings


def test_an_empty_file_is_the_defaults(tmp_path: Path) -> None:
    (tmp_path / "0.toml").write_text("")
    assert read_settings(tmp_path / "0.toml") == Settings()


def test_every_key_says_what_it_is() -> None:
    for line, key in zip(settings_text(Settings()).splitlines(), fields(Settings), strict=True):
        assert line.startswith(f"{key.name} = ")
        assert "  # " in line


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("red_gian = 1.2", "red_gain"),
        ("exposure = 1", "exposure_us"),
        ("rate_hz = 91", "rate_hz"),
        ("rate_hz = nan", "rate_hz"),
        ('rate_hz = "60"', "rate_hz"),
        ("rate_hz = true", "rate_hz"),
        ("exposure_us = 10.5", "exposure_us"),
        ("rate_hz = 60\nexposure_us = 16667", "exposure_us"),
        ("camera = -1", "camera"),
        ("width_px = 1920\nheight_px = 1080", "width_px"),
        ("width_px = 320", "width_px"),
        ("analogue_gain = 0.5", "analogue_gain"),
        ("red_gain = 0", "red_gain"),
        ('noise_reduction = "on"', "noise_reduction"),
        ('sync = "both"', "sync"),
        ('address = "0.0.0.0"', "address"),
        ('address = "::"', "address"),
        ('address = "224.0.0.1"', "address"),
        ('address = "ff02::1"', "address"),
        ('address = "255.255.255.255"', "not the address of one machine"),
        ('address = "fe80::1"', "known on one link only"),
        ('address = "fe80::1%eth0"', "known on one link only"),
        ('address = "fd00::1%eth0"', "known on one link only"),
        ('address = "pi.local"', "address"),
        ("address = 5", "address"),
        ("port = 0", "port"),
        ("max_clients = 100", "max_clients"),
        ("red_gain = ", "0.toml"),
        ("[camera]\nrate_hz = 5", "camera"),
    ],
)
def test_a_wrong_setting_is_refused_by_name(line: str, named: str, tmp_path: Path) -> None:
    file = tmp_path / "0.toml"
    file.write_text(line)
    with pytest.raises(WedgeError) as caught:
        read_settings(file)
    assert named in str(caught.value)
    assert str(caught.value).startswith(str(file))


def test_applying_wrong_settings_leaves_the_old_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place, new = tmp_path / "0.toml", tmp_path / "new.toml"
    write_settings(place, Settings(red_gain=2.0))
    before = place.read_bytes()
    new.write_text("red_gian = 1.0")
    assert main(["apply", str(new), str(place)]) == 2
    assert "red_gian" in capsys.readouterr().err
    assert place.read_bytes() == before
    new.write_text("red_gain = 1.0")
    assert main(["apply", str(new), str(place)]) == 0
    assert read_settings(place) == Settings(red_gain=1.0)
    assert {path.name for path in tmp_path.iterdir()} == {"0.toml", "new.toml"}
    assert place.stat().st_mode & 0o777 == 0o644  # the service's user must read what root wrote


def test_applying_keeps_which_camera_it_is_and_where_it_is_served(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place, new = tmp_path / "0.toml", tmp_path / "new.toml"
    of_the_pi = {"camera": 1, "sync": "client", "address": "192.168.1.42", "port": 8081}
    of_the_pi |= {"camera_id": "/base/ov5647@36", "max_clients": 2}
    write_settings(place, Settings(red_gain=2.0, **of_the_pi))
    tuned = Settings(red_gain=1.25, exposure_us=5000, width_px=320, height_px=240)
    write_settings(new, tuned)
    assert main(["apply", str(new), str(place)]) == 0
    assert read_settings(place) == replace(tuned, **of_the_pi)
    said = capsys.readouterr().out
    assert all(f"{key} = {value!r}" in said for key, value in of_the_pi.items())
    assert main(["apply", str(place), str(place)]) == 0
    assert main(["apply", str(new), str(tmp_path / "1.toml")]) == 0
    assert read_settings(tmp_path / "1.toml") == tuned
    assert capsys.readouterr().out == ""


def test_what_a_killed_apply_leaves_is_read_by_nobody_and_gone_after_the_next(
    tmp_path: Path,
) -> None:
    place, new, swap = tmp_path / "0.toml", tmp_path / "new.toml", tmp_path / ".0.toml.swp"
    write_settings(place, Settings(red_gain=2.0))
    new.write_text("red_gain = 1.0")
    swap.write_text("an editor's, with what nobody has saved yet")
    killed = """if True:
        import os, signal, sys
        os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
        from firmware_pi.__main__ import main
        main(["apply", *sys.argv[1:]])"""
    for _ in range(2):  # the second takes away what the first left
        words = [sys.executable, "-c", killed, str(new), str(place)]
        assert subprocess.run(words, check=False).returncode == -signal.SIGKILL
        (left,) = set(tmp_path.iterdir()) - {place, new, swap}
        assert left.name.startswith(".") and left.suffix != ".toml"
        assert read_settings(place) == Settings(red_gain=2.0)
    assert main(["apply", str(new), str(place)]) == 0
    assert read_settings(place) == Settings(red_gain=1.0)
    assert set(tmp_path.iterdir()) == {place, new, swap}


@pytest.mark.parametrize(
    ("key", "control"),
    [
        ("exposure_us", "ExposureTime"),
        ("analogue_gain", "AnalogueGain"),
        ("red_gain", "ColourGains"),
        ("blue_gain", "ColourGains"),
    ],
)
def test_what_is_allowed_is_within_what_libcamera_takes(key: str, control: str) -> None:
    (known,) = [known for known in fields(Settings) if known.name == key]
    least, most = LIBCAMERA["ranges"][control]
    assert least <= known.metadata["least"] <= known.metadata["most"] <= most


def test_the_default_rate_is_one_that_every_kernel_gives() -> None:
    _, slowest_us = LIBCAMERA["ranges"]["FrameDurationLimits"]
    assert Settings().frame_duration_us >= slowest_us
    assert replace(Settings(), rate_hz=60.0).frame_duration_us < slowest_us
