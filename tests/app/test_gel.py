# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The curved gel on which a touched object travels, and who says that it counts as flat."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from recon.pose.rest import rest_at
from recon.touch_file import SKIN
from sensor.design import FINGER, STANDARD
from sensor.unit import read_unit_card, write_unit_card
from tests.app.commands import run
from tests.app.test_track import workplace  # noqa: F401  (a fixture)
from tests.recon.stream.servers import free_port


def felt(path):
    """Points of the touched skin in mm, and shifts of the object, of all frames."""
    points, shifts_mm = [], []
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/wedge/contact":
                of_one = np.frombuffer(message.data.tobytes(), SKIN)
                points.append(1e3 * np.stack([of_one[axis] for axis in "xyz"], -1))
            elif connection.topic == "/tf":
                shift = message.transforms[0].transform.translation
                shifts_mm.append([1e3 * shift.x, 1e3 * shift.y, 1e3 * shift.z])
    return np.concatenate(points), np.array(shifts_mm)


def test_points_and_poses_lie_on_the_design_s_gel(workplace, tmp_path, capsys):  # noqa: F811
    unit = shutil.copytree(workplace / "unit", tmp_path / "unit")
    card, found = read_unit_card(unit), {}
    for name, of_unit, options, design, remarks in (
        ("flat", None, (), None, 0),
        ("asked", None, ("--design", "standard"), "standard", 0),
        ("own", STANDARD.sha256, (), "standard", 0),
        ("another's", FINGER.sha256, ("--design", "standard"), "standard", 1),
        ("unknown", "0" * 64, (), None, 1),
    ):
        write_unit_card(unit, replace(card, design_sha256=of_unit))
        out, told = tmp_path / name, tmp_path / f"{name}.json"
        words = ("track", unit, workplace / "clip", "--background", "first", "--json", told)
        assert run(*words, "--out", out, *options) == 0
        found[name] = felt(out / "poses.mcap")
        document = json.loads(told.read_text())
        assert document["design"] == design and len(document["remarks"]) == remarks
        said = "counts as flat" if design is None else "another design than standard"
        assert capsys.readouterr().err.count(said) == remarks
    for name in ("own", "another's"):
        for asked, same in zip(found["asked"], found[name], strict=True):
            np.testing.assert_array_equal(asked, same)
    (points, shifts_mm), (flat, flat_mm) = found["asked"], found["flat"]
    rest_mm, _ = rest_at(STANDARD.gel, flat[:, 0].astype(float), flat[:, 1].astype(float))
    assert rest_mm.max() > 0.02
    np.testing.assert_allclose(points, flat - np.outer(rest_mm, [0, 0, 1]), atol=1e-4)
    assert shifts_mm.shape == flat_mm.shape and (shifts_mm[1:] != flat_mm[1:]).any()


def test_written_points_lie_on_the_unit_s_own_gel_as_recorded_ones_do(workplace, tmp_path):  # noqa: F811
    unit, rest_mm = shutil.copytree(workplace / "unit", tmp_path / "unit"), {}
    card, told = read_unit_card(unit), tmp_path / "c.json"
    for name, of_unit in (("flat", None), ("own", STANDARD.sha256)):
        write_unit_card(unit, replace(card, design_sha256=of_unit))
        words = ("cloud", unit, unit / "background.png", "--form", "npz", "--json", told)
        assert run(*words, "--out", tmp_path / name) == 0
        with np.load(tmp_path / name / "background.npz") as cloud:
            rest_mm[name] = cloud["points_mm"].astype(float)
        assert json.loads(told.read_text())["design"] == (of_unit and "standard")
    lower_mm = rest_mm["flat"] - rest_mm["own"]
    expected_mm, _ = rest_at(STANDARD.gel, rest_mm["flat"][:, 0], rest_mm["flat"][:, 1])
    np.testing.assert_allclose(lower_mm, np.outer(expected_mm, [0, 0, 1]), atol=1e-6)
    assert expected_mm.max() > 0.02


@pytest.mark.parametrize(("of_unit", "remarks"), [(STANDARD.sha256, 0), ("0" * 64, 1)])
def test_the_live_page_says_that_a_gel_counts_as_flat(
    workplace,  # noqa: F811
    tmp_path,
    monkeypatch,
    capsys,
    of_unit,
    remarks,
):
    monkeypatch.setattr("app.pages.live.serve", lambda *_, **__: None)
    unit = shutil.copytree(workplace / "unit", tmp_path / "unit")
    write_unit_card(unit, replace(read_unit_card(unit), design_sha256=of_unit))
    words = ("live", workplace / "clip", "--unit", unit, "--captures", tmp_path)
    assert run(*words, "--port", free_port()) == 0
    assert capsys.readouterr().err.count("counts as flat") == remarks
