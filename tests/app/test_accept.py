# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge accept`: what it learns of a stream's frames, and where it writes nothing."""

from dataclasses import replace

import pytest

from app import accept
from recon.geometry.unwarp import prepare_unwarp
from recon.stream import Recorder
from sensor.errors import WedgeError
from tests.app.commands import refused
from tests.recon.stream.servers import FRAMES, ScriptedServer
from tests.recon.stream.test_http import numbered
from tests.recon.stream.test_newest import SCAN
from tests.recon.stream.test_recording import frame, record
from tests.synthetic import make_dataset

DAMAGED = FRAMES[0].replace(SCAN, SCAN[:9] + b"\xff\xd8" * 9)
"""A JPEG with its head and its end."""
UNWARP = prepare_unwarp((32, 24), None, None, None)


def test_frames_are_known_to_be_lost_by_their_numbers_alone(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(accept, "TIMED_FRAMES", 4)
    with ScriptedServer(numbered(0, 1, 5, 6)) as server:
        assert accept._times(server.url, UNWARP)[1] == [0, 1, 5, 6]
    times_ns, numbers = accept._times(str(record(tmp_path / "touch.mcap", 10)), UNWARP)
    assert len(times_ns) == 4 and numbers == []  # a recording holds what came


def test_damage_of_a_recording_is_told(tmp_path, capsys) -> None:
    path = record(tmp_path / "touch.mcap", 90)
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 3000] = bytes(3000)
    path.write_bytes(content)
    times_ns, _ = accept._times(str(path), UNWARP)
    assert 0 < len(times_ns) < 90
    assert f"{path}: " in capsys.readouterr().out


@pytest.mark.parametrize("broken", [0, 1])
def test_a_frame_that_is_damaged_within_is_no_frame(broken, tmp_path, capsys) -> None:
    path = tmp_path / "touch.mcap"
    with Recorder(path, {"wedge": None}) as recorder:
        for index in range(3):
            whole = frame(index)
            recorder.add("wedge", replace(whole, jpeg=DAMAGED) if index == broken else whole)
    times_ns, _ = accept._times(str(path), UNWARP)
    assert times_ns == [frame(index).time_ns for index in range(3) if index != broken]
    assert f"{path}: 1 damaged frame." in capsys.readouterr().out


def test_frames_of_which_none_is_whole_are_refused_by_their_place(tmp_path) -> None:
    path = tmp_path / "touch.mcap"
    with Recorder(path, {"wedge": None}) as recorder:
        recorder.add("wedge", replace(frame(0), jpeg=DAMAGED))
    with pytest.raises(WedgeError, match=rf"{path}.*, frame 0: the frame is not a whole JPEG"):
        accept._times(str(path), UNWARP)


@pytest.mark.parametrize("words", ["accept {unit} {set}", "evaluate {unit} {set}", "table {set}"])
def test_a_page_is_not_put_among_a_unit_s_own_files(words, tmp_path, capsys) -> None:
    unit, dataset = tmp_path / "unit", make_dataset(tmp_path / "set", presses=1)
    unit.mkdir()
    (unit / "unit.toml").touch()
    named = [word.format(unit=unit, set=dataset.folder) for word in words.split()]
    sentence = refused(capsys, *named, "--out", unit)
    assert "holds only its own files" in sentence
    assert [path.name for path in unit.iterdir()] == ["unit.toml"]
