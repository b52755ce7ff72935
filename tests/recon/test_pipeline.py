# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The closed loop: calibrate on rendered presses, save, load, and reconstruct presses unseen."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import recon
import sensor
from recon.ball import ball_cap
from recon.calibration import unit_of_set
from recon.contact.disturbed import boundary_of, disturbed_mask
from recon.contact.mask import contact_mask
from recon.depth import HINT_SHARE, SEEN_SHARE, infer_gradient, without
from recon.images import read_frame
from recon.integration.poisson import integrate
from recon.integration.pressed import nearest_pressed
from recon.integration.weighed import inferred_doubts, resting, weighed_depth
from recon.missing_axis.columns import weigh_columns
from recon.missing_axis.inference import infer_missing_axis
from recon.missing_axis.moved import FLANK, MARGIN_PX
from recon.pipeline import Reconstructor, reconstruct
from recon.still import REACH
from sensor.errors import WedgeError
from tests.synthetic import (
    BALL_RADIUS_MM,
    KEYSTONE_PX,
    MM_PER_PX,
    SIZE_PX,
    digitized,
    gradient_of,
    make_dataset,
    shaded,
    true_depth_mm,
)


def save_unit(dataset, folder, estimator="mlp"):
    unit_of_set(dataset, estimator).save(folder)


@pytest.fixture(scope="module", params=[None, KEYSTONE_PX], ids=["straight", "keystone"])
def sets(request, tmp_path_factory):
    """A dataset to calibrate on and one of other presses, of the same sensor."""
    folder = tmp_path_factory.mktemp("sets")
    return (
        make_dataset(folder / "seen", corners_px=request.param),
        make_dataset(folder / "unseen", seed=1, presses=6, corners_px=request.param),
    )


@pytest.fixture(scope="module")
def loop(sets, tmp_path_factory):
    """A unit folder, and a dataset of presses that it has not seen."""
    pytest.importorskip("torch")
    seen, unseen = sets
    unit = tmp_path_factory.mktemp("units") / "unit"
    save_unit(seen, unit)
    return unit, unseen


def test_three_lines_give_depth_in_millimetres(loop):
    unit, unseen = loop
    background, frame = (read_frame(unseen.folder, n) for n in ("background.png", "press00.png"))
    reconstruct = Reconstructor.load(unit, background)
    depth_mm = reconstruct(frame).depth_mm
    assert depth_mm.shape == SIZE_PX[::-1] and depth_mm.dtype == np.float32
    assert depth_mm.max() == pytest.approx(true_depth_mm(unseen.labels[0]).max(), rel=0.09)


# The table knows this sensor, which is blind to position, all but exactly; a network that saw a
# dozen presses for a second does not.
@pytest.mark.parametrize(
    ("estimator", "rmse", "scale"), [("table", 0.01, 0.04), ("mlp", 0.04, 0.09)]
)
def test_unseen_balls_have_their_depth_place_and_outline(sets, tmp_path, estimator, rmse, scale):
    pytest.importorskip("torch")
    seen, unseen = sets
    save_unit(seen, tmp_path / "unit", estimator)
    reconstruct = Reconstructor.load(str(tmp_path / "unit"))
    for label in unseen.labels:
        found = reconstruct(read_frame(unseen.folder, label.file))
        truth = true_depth_mm(label)
        depth = found.depth_mm
        assert np.sqrt(np.mean((depth - truth) ** 2)) <= rmse * truth.max()
        assert (depth * truth).sum() / (truth**2).sum() == pytest.approx(1, abs=scale)
        rows, columns = np.indices(depth.shape)
        deep = np.maximum(depth - depth.max() / 2, 0)
        center = (deep * columns).sum() / deep.sum(), (deep * rows).sum() / deep.sum()
        assert center == pytest.approx(label.center_px, abs=0.5)
        touched = truth > 0
        assert (found.contact & touched).sum() / (found.contact | touched).sum() >= 0.75
        expected = boundary_of(disturbed_mask(found.difference))
        assert found.boundary == expected and found.mm_per_px == MM_PER_PX


def test_blank_gel_is_flat_and_untouched(loop):
    unit, unseen = loop
    found = Reconstructor.load(unit)(read_frame(unseen.folder, "background.png"))
    assert not found.contact.any() and found.boundary == "dirichlet"
    assert np.abs(found.depth_mm).max() <= 0.02


def test_todays_background_takes_the_place_of_the_units(loop):
    unit, unseen = loop
    frame, blank = (read_frame(unseen.folder, n) for n in ("press01.png", "background.png"))
    stain = np.zeros_like(blank)
    stain[:, :40] = 20  # a good third of the gel, by grey levels
    usual = Reconstructor.load(unit, blank)(frame).depth_mm
    stained = Reconstructor.load(unit, blank + stain)(frame + stain).depth_mm
    np.testing.assert_allclose(stained, usual, atol=1e-4)


def test_a_frame_or_a_background_of_another_size_is_refused(loop):
    unit, _ = loop
    small = np.zeros((30, 40, 3), np.uint8)
    with pytest.raises(WedgeError, match="the frame is 40x30 pixels"):
        Reconstructor.load(unit)(small)
    with pytest.raises(WedgeError, match="the frame is 40x30 pixels"):
        Reconstructor.load(unit, small)


def test_what_is_no_unit_is_refused(tmp_path):
    with pytest.raises(WedgeError, match="does not exist: name a unit folder"):
        Reconstructor.load(tmp_path / "none")


def test_a_ball_at_the_frames_edge_keeps_its_depth(loop):
    unit, unseen = loop
    if unseen.card.corners_px:
        pytest.skip("the raw frame shows more than the pad")
    place = (60.0, 2.0, 17.0)
    frame = digitized(shaded(gradient_of(place)))
    found = Reconstructor.load(unit)(frame)
    truth = ball_cap(SIZE_PX, place[:2], 1.7, BALL_RADIUS_MM, MM_PER_PX).depth_mm
    assert found.boundary == "neumann"
    assert np.sqrt(np.mean((found.depth_mm - truth) ** 2)) <= 0.06 * truth.max()


@pytest.mark.parametrize("lights_deg", [{"R": 90.0, "B": -90.0}, {"G": 180.0}], ids=["RB", "G"])
def test_an_axis_without_light_is_filled_in(tmp_path, lights_deg):
    save_unit(make_dataset(tmp_path / "seen", lights_deg=lights_deg), tmp_path / "unit", "table")
    unseen = make_dataset(tmp_path / "unseen", seed=2, presses=3, lights_deg=lights_deg)
    reconstruct = Reconstructor.load(tmp_path / "unit")
    without = replace(
        reconstruct.calibration, card=replace(reconstruct.calibration.card, missing_axis="zero")
    )
    lost = 0 if "R" in lights_deg else 1
    for label in unseen.labels:
        frame = read_frame(unseen.folder, label.file)
        truth = true_depth_mm(label)
        found, zeroed = reconstruct(frame), Reconstructor(without)(frame)
        assert found.depth_mm.min() >= 0 and found.doubt[truth > 0].min() > 0
        assert zeroed.doubt is None
        assert not zeroed.gradient[..., lost].any()
        errors = [np.sqrt(np.mean((f.depth_mm - truth) ** 2)) for f in (found, zeroed)]
        assert errors[0] < 0.6 * errors[1] and errors[0] <= 0.15 * truth.max()


@pytest.mark.parametrize(
    ("place", "share"),
    [((60.0, 2.0, 17.0), 0.9), ((2.0, 45.0, 17.0), 0.6), ((118.0, 88.0, 17.0), 0.9)],
    ids=["above", "beside", "in the corner"],
)
def test_few_lights_bear_a_contact_that_touches_the_border(tmp_path, place, share):
    lights_deg = {"R": 90.0, "B": -90.0}
    save_unit(make_dataset(tmp_path / "seen", lights_deg=lights_deg), tmp_path / "unit", "table")
    found = Reconstructor.load(tmp_path / "unit")(digitized(shaded(gradient_of(place), lights_deg)))
    truth = ball_cap(SIZE_PX, place[:2], 1.7, BALL_RADIUS_MM, MM_PER_PX).depth_mm
    assert 0 <= found.depth_mm.min() and found.depth_mm.max() < 1.5 * truth.max()
    assert np.sqrt(np.mean((found.depth_mm - truth) ** 2)) < share * np.sqrt(np.mean(truth**2))


EVERYWHERE = np.ones((16, 24), bool)
GRADIENT = np.random.default_rng(0).normal(size=(16, 24, 2)).astype(np.float32)


@pytest.mark.parametrize("reach", [None, REACH])
@pytest.mark.parametrize("lights_deg", [None, {"R": 90.0, "G": 180.0, "B": -90.0}])
def test_where_every_axis_is_seen_nothing_is_inferred(lights_deg, reach):
    cap = ball_cap((60, 40), (30.0, 20.0), 0.8, 1.6, MM_PER_PX)
    known = Known(cap.gradient + 0.005)  # still gel is not quite flat
    known.reach = reach
    difference = (cap.contact[..., None] * np.array([0.2, -0.1, 0.1])).astype(np.float32)
    none, network = (
        reconstruct(difference, known, missing=missing, lights_deg=lights_deg, mm_per_px=MM_PER_PX)
        for missing in ("none", "network")
    )
    np.testing.assert_array_equal(network.depth_mm, none.depth_mm)
    np.testing.assert_array_equal(network.gradient, none.gradient)
    assert network.doubt is None and (none.gradient == 0).any() == (reach is not None)


@pytest.mark.parametrize(("unseen", "lost"), [("x", 0), ("y", 1)])
def test_the_unseen_axis_is_replaced_and_not_looked_at(unseen, lost):
    before = GRADIENT.copy()
    found = infer_gradient(GRADIENT, EVERYWHERE, unseen, MM_PER_PX)
    np.testing.assert_array_equal(GRADIENT, before)
    other = GRADIENT.copy()
    other[..., lost] = 7
    again = infer_gradient(other, EVERYWHERE, unseen, MM_PER_PX)
    np.testing.assert_array_equal(again.gradient, found.gradient)
    assert found.gradient[..., lost].any()
    zero = without(unseen, GRADIENT)
    assert not zero[..., lost].any()
    np.testing.assert_array_equal(zero[..., 1 - lost], GRADIENT[..., 1 - lost])


@pytest.mark.parametrize(("unseen", "lost"), [("x", 0), ("y", 1)])
def test_of_a_hint_a_share_is_taken_where_the_gel_may_have_moved(unseen, lost):
    left = EVERYWHERE.copy()
    left[:, 12:] = False
    inferred, told = (
        infer_gradient(GRADIENT, left, unseen, MM_PER_PX, hinted=hinted) for hinted in (False, True)
    )
    support = told.support
    expected = inferred.gradient.copy()
    expected[..., lost] *= 1 - HINT_SHARE
    expected[..., lost] += HINT_SHARE * GRADIENT[..., lost] * support
    np.testing.assert_allclose(told.gradient, expected, atol=1e-6)
    assert np.abs(told.gradient - inferred.gradient).max() > 0.01


@pytest.mark.parametrize(("unseen", "lost"), [("x", 0), ("y", 1)])
def test_of_the_seen_slope_a_share_is_kept_where_the_gel_may_have_moved(unseen, lost):
    left = EVERYWHERE.copy()
    left[:, 12:] = False
    found = infer_gradient(GRADIENT, left, unseen, MM_PER_PX)
    support, seen = found.support, GRADIENT[..., 1 - lost]
    assert not support.all()
    inferred = infer_missing_axis(seen, unseen, MM_PER_PX, support=support)
    cleaned = weigh_columns(inferred, seen, unseen, support, MM_PER_PX).gradient[..., 1 - lost]
    expected = (1 - SEEN_SHARE) * cleaned + SEEN_SHARE * seen * support
    np.testing.assert_allclose(found.gradient[..., 1 - lost], expected, atol=1e-6)
    assert np.abs(cleaned - seen * support).max() > 0.05


@pytest.mark.parametrize(("unseen", "lost"), [("x", 0), ("y", 1)])
def test_where_nothing_moved_the_network_answers_with_flat_gel(unseen, lost):
    left = EVERYWHERE.copy()
    left[:, 12:] = False
    masked = infer_gradient(GRADIENT, left, unseen, MM_PER_PX)
    assert masked.gradient[:, :12, lost].any()
    flat = np.s_[:, 12 + MARGIN_PX + round(FLANK * min(left.shape)) :]
    if unseen == "x":  # along the lights, gel between two halves of a contact may have moved
        assert not masked.gradient[flat].any() and not masked.doubt[flat].any()
    assert not masked.gradient[~masked.support].any()


class Known:
    """An estimator that knows the gradient of a 60x40 frame."""

    name = "known"
    channels = "RGB"
    reach = None
    looks_around = False
    lean = staticmethod(np.zeros_like)
    half_width = staticmethod(lambda slopes: None)

    def __init__(self, gradient):
        self.gradient = gradient.astype(np.float32)

    def prepared(self, difference):
        return difference

    def asked(self, difference):
        return difference

    def slopes(self, color, position):
        return self.gradient.reshape(-1, 2)

    def tensors(self):
        return {}


@pytest.mark.parametrize("everywhere", [False, True])
def test_with_a_free_border_untouched_gel_lies_at_zero(everywhere):
    cap = ball_cap((60, 40), (0.0, 20.0), 1.2, 2.0, MM_PER_PX)
    touched = np.ones_like(cap.contact) if everywhere else cap.contact
    difference = (touched[..., None] * np.array([0.2, -0.1, 0.1])).astype(np.float32)
    found = reconstruct(
        difference, Known(cap.gradient), missing="none", lights_deg=None, mm_per_px=MM_PER_PX
    )
    assert found.boundary == "neumann" and np.isfinite(found.depth_mm).all()
    if not everywhere:
        untouched = ~disturbed_mask(difference)
        assert abs(np.median(found.depth_mm[untouched])) < 1e-6
        assert found.depth_mm.max() == pytest.approx(cap.depth_mm.max(), rel=0.05)


def test_a_colour_that_the_estimator_does_not_look_at_disturbs_nothing():
    cap = ball_cap((60, 40), (30.0, 20.0), 1.2, 2.0, MM_PER_PX)
    difference = (cap.contact[..., None] * np.array([0.0, 0.0, 0.2])).astype(np.float32)
    blind = Known(cap.gradient)
    blind.channels = "RG"
    options = {"missing": "none", "lights_deg": None, "mm_per_px": MM_PER_PX}
    assert not reconstruct(difference, blind, **options).contact.any()
    assert reconstruct(difference, Known(cap.gradient), **options).contact.any()


@pytest.mark.parametrize("package", [recon, sensor], ids=["recon", "sensor"])
def test_nothing_is_ever_allowed_to_unpickle(package):
    for path in Path(package.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                assert getattr(node.value, "value", None) is False, path


@pytest.mark.parametrize("reach", [None, REACH])
def test_still_gel_is_made_flat_for_estimators_that_ask_for_it(reach):
    cap = ball_cap((60, 40), (16.0, 20.0), 0.6, 1.2, MM_PER_PX)
    wrong = cap.gradient + 0.02
    known = Known(wrong)
    known.reach = reach
    difference = (cap.contact[..., None] * np.array([0.2, -0.1, 0.1])).astype(np.float32)
    found = reconstruct(
        difference, known, missing="none", lights_deg=None, mm_per_px=MM_PER_PX
    ).gradient
    np.testing.assert_array_equal(found[cap.contact], np.float32(wrong)[cap.contact])
    assert (found[:, 40:] == 0).all() == (reach is not None)


@pytest.mark.parametrize("reach", [None, REACH])
def test_slopes_count_by_their_doubt_where_still_gel_is_known(reach):
    cap = ball_cap((60, 40), (30.0, 20.0), 0.8, 1.6, MM_PER_PX)
    known = Known(cap.gradient * np.array([1.0, 0.7]) + 0.1 * np.sign(cap.gradient))
    known.reach = reach
    difference = (cap.contact[..., None] * np.array([0.2, -0.1, 0.1])).astype(np.float32)
    found = reconstruct(difference, known, missing="none", lights_deg=None, mm_per_px=MM_PER_PX)
    assert found.boundary == "dirichlet"
    free = integrate(found.gradient, MM_PER_PX, "dirichlet")
    rests = resting(found.gradient, free, 40 * MM_PER_PX[1])
    weighed = weighed_depth(free, found.gradient, MM_PER_PX, "dirichlet", rests=rests)
    np.testing.assert_array_equal(found.depth_mm, weighed if reach else free)
    assert np.allclose(found.depth_mm, free, atol=1e-4) == (reach is None)


@pytest.mark.parametrize(("lights_deg", "unseen"), [((90.0, -90.0), "x"), ((0.0, 180.0), "y")])
def test_the_depth_asks_less_of_slopes_that_were_inferred(lights_deg, unseen):
    cap = ball_cap((60, 40), (30.0, 20.0), 0.8, 1.6, MM_PER_PX)
    known = Known(cap.gradient)
    known.channels = "RB"
    difference = (cap.contact[..., None] * np.array([0.2, 0.0, 0.1])).astype(np.float32)
    lights = dict(zip("RB", lights_deg, strict=True))
    how = {"missing": "network", "lights_deg": lights, "mm_per_px": MM_PER_PX}
    found = reconstruct(difference, known, **how)
    field = infer_gradient(cap.gradient, found.disturbed, unseen, MM_PER_PX)
    free = integrate(field.gradient, MM_PER_PX, "dirichlet")
    doubts = inferred_doubts(field.gradient, unseen, field.network_doubt)
    weighed = weighed_depth(free, field.gradient, MM_PER_PX, "dirichlet", doubts)
    pressed = nearest_pressed(weighed, field.support, MM_PER_PX, "dirichlet")
    np.testing.assert_allclose(found.depth_mm, pressed, atol=1e-4)  # a step of the solver apart
    assert not np.allclose(weighed, free, atol=1e-3)


def test_hints_come_from_estimators_that_look_around():
    cap = ball_cap((60, 40), (30.0, 20.0), 1.2, 2.0, MM_PER_PX)
    difference = (cap.contact[..., None] * np.array([0.2, 0.0, 0.1])).astype(np.float32)

    def across(error, looks_around):
        known = Known(cap.gradient + np.array([error, 0.0]))
        known.channels, known.looks_around = "RB", looks_around
        options = {"lights_deg": {"R": 90.0, "B": -90.0}, "mm_per_px": MM_PER_PX}
        return reconstruct(difference, known, missing="network", **options).gradient[..., 0]

    np.testing.assert_array_equal(across(0.4, False), across(0.0, False))
    raised = (across(0.4, True) - across(0.0, True))[cap.contact]
    np.testing.assert_allclose(raised, 0.4 * HINT_SHARE, atol=1e-5)


def test_where_it_touches_is_worked_out_once_and_only_when_asked(loop, monkeypatch):
    unit, unseen = loop
    background, frame = (read_frame(unseen.folder, n) for n in ("background.png", "press00.png"))
    asked = []

    def counted(*maps):
        asked.append(maps)
        return contact_mask(*maps)

    monkeypatch.setattr("recon.touched.contact_mask", counted)
    found = Reconstructor.load(unit, background)(frame)
    assert not asked
    assert found.contact.any() and found.contact is found.contact
    assert found.patches
    assert len(asked) == 1
