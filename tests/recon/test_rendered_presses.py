# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a rendered set, read with their truth."""

import io

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from recon.rendered_presses import depth_files, read_depth, rendered_presses
from sensor.errors import WedgeError
from tests.synthetic import (
    MM_PER_PX,
    SIZE_PX,
    gradient_of,
    make_rendered_set,
    shaded,
    true_depth_mm,
)
from tests.written import write_anew


def test_presses_come_in_order_with_what_changed_and_their_own_depth(tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=3, noise_gray_levels=0)
    found = list(rendered_presses(made.folder))
    assert [press.name for press in found] == [path.stem for path in depth_files(made.folder)]
    for press, label in zip(found, made.labels, strict=True):
        assert press.mm_per_px == MM_PER_PX and press.name in label.file
        np.testing.assert_array_equal(press.depth_mm, true_depth_mm(label))
        np.testing.assert_array_equal(press.held, true_depth_mm(label) > 0)
        place = label.center_x_px, label.center_y_px, label.contact_radius_px
        change = shaded(gradient_of(place)) - shaded(gradient_of(None))
        pressed = press.depth_mm > 0
        assert np.abs(press.difference - change)[pressed].mean() < 0.005
        assert np.abs(change)[pressed].mean() > 0.03


@pytest.mark.parametrize("truth", ["truth", "held"])
def test_a_truth_of_another_size_is_refused(truth, tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=2)
    first, last = depth_files(made.folder)
    np.save(made.folder / truth / last.name, np.zeros((3, 4)))
    presses = rendered_presses(made.folder)
    assert next(presses).name == first.stem
    with pytest.raises(WedgeError, match=rf"{truth}/{last.name} does not hold 90 rows of 120 "):
        next(presses)


def npy(head, version=b"\1\0"):
    """An ``.npy`` of any head, and zeros."""
    head = head.encode() + b"\n"
    return b"\x93NUMPY" + version + len(head).to_bytes(2 * version[0], "little") + head + bytes(64)


def saved(save, *arrays):
    stream = io.BytesIO()
    save(stream, *arrays)
    return stream.getvalue()


SHAPE = SIZE_PX[::-1]
HEAD = "{{'descr': {}, 'fortran_order': False, 'shape': {}}}"


class Hostile:
    """What would end the test if it was unpickled."""

    def __reduce__(self):
        return pytest.exit, ("an object array was unpickled",)


@pytest.mark.parametrize("truth", ["truth", "held"])
@pytest.mark.parametrize(
    "content",
    {
        "empty": b"",
        "no head": b"\x93NUMPY",
        "of tomorrow": npy(HEAD.format("'<f4'", SHAPE), b"\4\0"),
        "with a head of no Python": npy("{'descr': '<f4', 'shape': ("),
        "with a head of other Python": npy("[].append"),
        "with a head of another thing": npy("{'descr': '<f4'}"),
        "with a vast head": npy("(" * 60_000),
        "cut off": saved(np.save, np.ones(SHAPE))[:-1],
        "of a vast size": npy(HEAD.format("'<f4'", (10**9, 10**9))),
        "without a size": saved(np.save, np.float32(1)),
        "of another size": saved(np.save, np.ones((3, 4))),
        "with a size too many": saved(np.save, np.ones((*SHAPE, 1))),
        "of integers": saved(np.save, np.ones(SHAPE, int)),
        "of texts": saved(np.save, np.full(SHAPE, "1.0")),
        "of records": saved(np.save, np.ones(SHAPE, [("mm", "f4")])),
        "of objects": saved(np.save, np.full(SHAPE, Hostile(), object)),
        "an archive": saved(np.savez, np.ones(SHAPE)),
        "a pickle": b"\x80\4]q\0.",
        "a text": b"depth in mm\n",
    }.items(),
    ids=lambda content: content[0],
)
def test_a_damaged_truth_is_one_sentence(truth, content, tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=1)
    (path,) = (made.folder / truth).iterdir()
    path.write_bytes(content[1])
    with pytest.raises(WedgeError) as told:
        list(rendered_presses(made.folder))
    assert str(told.value).startswith(f"{path} ")
    assert "copy or make it again." in str(told.value) and len(str(told.value).splitlines()) == 1


@given(st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_truth_with_any_bytes_changed_is_depths_or_a_sentence(tmp_path, data):
    content = bytearray(saved(np.save, np.ones((4, 5), np.float32)))
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=4)):
        content[place] = data.draw(st.integers(0, 255))
    path = tmp_path / "truth.npy"
    write_anew(path, content[: data.draw(st.integers(0, len(content)))])
    try:
        depth_mm = read_depth(path, (4, 5), (1.0, 1.0))
    except WedgeError as error:
        assert str(error).startswith(f"{path} ")
    else:
        assert depth_mm.shape == (4, 5) and np.isfinite(depth_mm).all()


@pytest.mark.parametrize("depth", [0.0, -1.0, np.nan, np.inf])
def test_depths_of_nothing_are_refused(tmp_path, depth):
    np.save(tmp_path / "a.npy", np.full((4, 5), depth))
    with pytest.raises(WedgeError, match="finite depths in mm, some of them above zero"):
        read_depth(tmp_path / "a.npy", (4, 5), (1.0, 1.0))
    with pytest.raises(WedgeError, match=r"b\.npy is missing"):
        read_depth(tmp_path / "b.npy", (4, 5), (1.0, 1.0))


@pytest.mark.parametrize("mm_per_px", [(0.2, 0.1), (0.08, 0.3)])
def test_depths_beyond_the_frame_s_shorter_side_are_not_in_mm(tmp_path, mm_per_px):
    path, side_mm = tmp_path / "truth.npy", 0.4
    depth_mm = np.zeros((4, 5), np.float32)
    for deepest_mm in (0.9 * side_mm, 1.1 * side_mm):
        depth_mm[2, 1] = deepest_mm
        np.save(path, depth_mm)
        if deepest_mm < side_mm:
            assert np.array_equal(read_depth(path, (4, 5), mm_per_px), depth_mm)
        else:
            with pytest.raises(WedgeError, match=r"up to 0\.44 mm, .* only 0\.4 mm wide"):
                read_depth(path, (4, 5), mm_per_px)


def test_a_set_need_not_say_what_is_held(tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=1)
    (made.folder / "held" / depth_files(made.folder)[0].name).unlink()
    (press,) = rendered_presses(made.folder)
    assert press.held is None
