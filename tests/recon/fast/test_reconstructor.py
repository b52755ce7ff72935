# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The quick way says what the slow way says: from a JPEG to depth."""

import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from recon.ball import ball_cap
from recon.estimators.lookup_table import BINS, LookupTable
from recon.fast import FastReconstructor, fixed_point
from recon.integration.poisson import integrate
from recon.integration.weighed import resting, weighed_depth
from recon.pipeline import Reconstructor
from recon.quarters import in_pixels, in_quarters
from recon.stream.frame import TimedFrame
from recon.stream.jpeg import decode_jpeg, encode_jpeg
from sensor.errors import WedgeError
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px, pad
from tests.recon.fast.units import (
    CORNERS_PX,
    SLOPE,
    make_unit,
    pressed,
    random_default,
    random_mlp,
    scaled,
)

RED_AND_BLUE = {
    "channels": "RB",
    "missing_axis": "network",
    "lights_deg": {"R": 90.0, "B": -90.0},
}


def to_the_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    """How many steps are taken is a matter of rounding, where they end before it."""
    monkeypatch.setattr("recon.integration.weighed.STEPS", 200)
    monkeypatch.setattr("recon.integration.weighed.ENOUGH", 1e-10)


def in_bytes(image: np.ndarray) -> np.ndarray:
    return np.round(255 * image).clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("corners_px", [None, CORNERS_PX])
@pytest.mark.parametrize("center_px", [(80, 60), (10, 60)])
@pytest.mark.parametrize(("words", "depth_share"), [(True, 2e-4), (False, 1e-4)])
def test_a_jpeg_gives_the_depth_of_the_reference(
    monkeypatch: pytest.MonkeyPatch,
    corners_px: tuple | None,
    center_px: tuple,
    words: bool,
    depth_share: float,
) -> None:
    monkeypatch.setattr(fixed_point, "AVAILABLE", words and fixed_point.AVAILABLE)
    unit = make_unit(corners_px=corners_px)
    jpeg = encode_jpeg(pressed(unit.background, center_px), 95)
    touch = FastReconstructor(unit)(jpeg)
    truth = Reconstructor(unit)(decode_jpeg(jpeg))
    assert touch.boundary == truth.boundary
    assert np.abs(touch.gradient - truth.gradient).max() < SLOPE
    error = touch.depth_mm - truth.depth_mm
    assert np.ptp(error) < depth_share * np.ptp(truth.depth_mm)
    assert np.abs(error).max() < 1e-2 * np.ptp(truth.depth_mm)  # where untouched gel lies
    assert touch.contact.shape == truth.contact.shape


def test_every_kind_of_frame_gives_the_same() -> None:
    unit = make_unit()
    jpeg = encode_jpeg(pressed(unit.background, (80, 60)), 95)
    timed = TimedFrame(index=0, time_ns=0, arrived_ns=0, jpeg=jpeg)
    pixels = TimedFrame(index=0, time_ns=0, arrived_ns=0, pixels=decode_jpeg(jpeg))
    depths = [
        FastReconstructor(unit, threads=threads)(frame).depth_mm.copy()
        for threads in (1, 7)  # of which the rows are no whole number
        for frame in (jpeg, decode_jpeg(jpeg), timed, pixels)
    ]
    for depth in depths[1:]:
        np.testing.assert_allclose(depth, depths[0], atol=1e-6)


def test_there_must_be_a_thread() -> None:
    with pytest.raises(WedgeError, match="threads must be 1 or more, not 0"):
        FastReconstructor(make_unit((32, 24)), threads=0)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_large_frame_s_slopes_are_asked_for_as_the_reference_does(threads: int) -> None:
    unit = make_unit((640, 480), estimator=random_default())
    frame = pressed(unit.background, (320, 240))
    touch, truth = FastReconstructor(unit, threads=threads)(frame), Reconstructor(unit)(frame)
    assert truth.gradient.any(-1).all()  # steep everywhere: no gel is still
    assert np.abs(touch.gradient - truth.gradient).max() < SLOPE
    assert np.abs(truth.gradient).max() > 0.1


@pytest.mark.parametrize("size_px", [(320, 240), (640, 480)])
def test_gel_that_did_not_move_is_flat_where_the_reference_says_so(size_px) -> None:
    unit = make_unit(size_px, estimator=random_default())
    still = replace(unit.estimator, layers=scaled(unit.estimator, 0.02))  # slopes tell of nothing
    unit = replace(unit, estimator=still)
    frame = pressed(unit.background, (size_px[0] / 2, size_px[1] / 2))
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    flat = ~truth.gradient.any(-1)
    assert 0.1 < flat.mean() < 0.9
    alike = flat == ~touch.gradient.any(-1)
    assert alike.mean() > 0.94
    assert np.abs(touch.gradient - truth.gradient)[alike].max() < SLOPE
    pitch_mm, border = unit.card.mm_per_px, touch.boundary
    plain_mm = integrate(touch.gradient, pitch_mm, border)
    rests = resting(touch.gradient, plain_mm, size_px[1] * pitch_mm[1])
    wanted_mm = weighed_depth(plain_mm, touch.gradient, pitch_mm, border, rests=rests)
    most_mm = np.abs(wanted_mm - plain_mm).max()  # what still gel counts for
    assert most_mm > 0.2 * np.ptp(plain_mm)
    assert np.abs(touch.depth_mm - wanted_mm).max() < 0.01 * most_mm


@pytest.mark.parametrize("size_px", [(64, 48), (97, 83), (200, 150)])
@pytest.mark.parametrize("center", [0.5, 0.05])
def test_small_frames_are_flat_exactly_where_the_reference_says_so(size_px, center) -> None:
    unit = make_unit(size_px, estimator=random_default())
    still = replace(unit.estimator, layers=scaled(unit.estimator, 0.02))
    unit = replace(unit, estimator=still)
    frame = pressed(unit.background, (center * size_px[0], center * size_px[1]))
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    assert 0.05 < truth.gradient.any(-1).mean() < 0.9
    assert touch.boundary == truth.boundary
    np.testing.assert_array_equal(touch.disturbed, truth.disturbed)
    np.testing.assert_array_equal(touch.gradient.any(-1), truth.gradient.any(-1))
    assert np.abs(touch.gradient - truth.gradient).max() < SLOPE
    assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.01 * np.ptp(truth.depth_mm)
    np.testing.assert_array_equal(touch.contact, truth.contact)


@pytest.mark.parametrize("first_px", range(1, 6))
def test_a_small_frame_s_border_is_free_where_the_reference_s_is(first_px) -> None:
    unit = make_unit()
    frame = unit.background.copy()
    frame[50:80, first_px:30] = 255 - frame[50:80, first_px:30]
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    assert touch.boundary == truth.boundary


@pytest.mark.parametrize("corners_px", [None, CORNERS_PX])
def test_the_lookup_table_is_the_reference_s_at_its_bins_edges_too(corners_px) -> None:
    rng = np.random.default_rng(0)
    bins = rng.normal(size=(BINS, BINS, BINS, 2)).astype(np.float32)
    end = np.full(3, BINS / 510, np.float32)  # each byte more is the next bin
    table = LookupTable(channels="RGB", low=-end, high=end, bins=bins)
    unit = make_unit(corners_px=corners_px, estimator=table)
    frame = pressed(unit.background, (80, 60))
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    np.testing.assert_array_equal(touch.gradient, truth.gradient)


@pytest.mark.parametrize("kind", [random_mlp, random_default])
@pytest.mark.parametrize("missing", ["network", "zero"])
@pytest.mark.parametrize("red_deg", [90.0, 0.0, 50.0])
def test_an_axis_without_light_is_inferred_as_the_reference_infers_it(
    kind, missing, red_deg, monkeypatch
) -> None:
    to_the_minimum(monkeypatch)
    lights_deg = {"R": red_deg, "B": red_deg - 180}
    card = RED_AND_BLUE | {"missing_axis": missing, "lights_deg": lights_deg}
    unit = make_unit((160, 120), estimator=kind(channels="RB"), **card)
    jpeg = encode_jpeg(pressed(unit.background, (80, 60)), 95)
    touch, truth = FastReconstructor(unit)(jpeg), Reconstructor(unit)(decode_jpeg(jpeg))
    # Integrals along the lights add up what one slope is off.
    assert np.abs(touch.gradient - truth.gradient).max() < 3 * SLOPE
    assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.01 * np.ptp(truth.depth_mm)
    assert (touch.contact == truth.contact).mean() > 0.99
    assert (touch.slope_error is None) == (truth.slope_error is None)
    if truth.slope_error is not None:
        np.testing.assert_allclose(touch.slope_error, truth.slope_error, atol=0.01)


@pytest.mark.parametrize("beyond", [(120, 0), (0, 120), (40, 80)])
@pytest.mark.parametrize("kind", [random_mlp, random_default])
def test_a_frame_is_mirrored_as_the_reference_does(kind, beyond, monkeypatch) -> None:
    """Then gel counts that else could not have moved."""
    to_the_minimum(monkeypatch)
    for module in ("recon.depth", "recon.fast.reconstructor"):
        monkeypatch.setattr(f"{module}.rows_beyond", lambda *_, hinted: beyond)
    unit = make_unit((160, 120), estimator=kind(channels="RB"), **RED_AND_BLUE)
    frame = pressed(unit.background, (80, 25))
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    assert np.abs(touch.gradient - truth.gradient).max() < 3 * SLOPE
    assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.01 * np.ptp(truth.depth_mm)


@pytest.mark.parametrize("size_px", [(480, 360), (400, 470), (960, 440)])
@pytest.mark.parametrize("kind", [random_mlp, random_default])
def test_a_long_frame_s_axis_is_inferred_as_the_reference_infers_it(
    kind, size_px, monkeypatch
) -> None:
    to_the_minimum(monkeypatch)
    unit = make_unit(size_px, estimator=kind(channels="RB"), **RED_AND_BLUE)
    frame = pressed(unit.background, (200, 20))
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    assert touch.boundary == truth.boundary == "neumann"
    assert np.abs(touch.gradient - truth.gradient).max() < 3 * SLOPE
    assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.01 * np.ptp(truth.depth_mm)


@pytest.mark.parametrize("lit", [{}, RED_AND_BLUE, RED_AND_BLUE | {"missing_axis": "none"}])
@pytest.mark.parametrize("kind", [random_mlp, random_default])
def test_dots_are_filled_as_the_reference_fills_them(kind, lit, monkeypatch) -> None:
    to_the_minimum(monkeypatch)
    places = grid_px()
    unit = make_unit((WIDTH, HEIGHT), estimator=kind(channels=lit.get("channels", "RGB")), **lit)
    blank, changed = dotted(places), pad()
    changed[50:120, 70:150] += [0.1, -0.05, -0.1]
    card = replace(unit.card, markers={"count": float(len(places))})
    unit = replace(unit, card=card, background=in_bytes(blank))
    frame = in_bytes(dotted(places + 0.7, image=changed, seed=1))
    quick = FastReconstructor(unit)
    quick(in_bytes(dotted(places + 3.0)))  # another frame's dots leave no trace
    touch, truth = quick(frame), Reconstructor(unit)(frame)
    assert truth.markers == "tracked"
    np.testing.assert_allclose(touch.difference, truth.difference, atol=1e-5)
    assert np.abs(touch.gradient - truth.gradient).max() < SLOPE
    assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.02 * np.ptp(truth.depth_mm)


@pytest.mark.parametrize("scale", [1, 2])
def test_dots_at_a_contact_s_rim_are_filled_before_still_gel_is_made_flat(scale: int) -> None:
    size_px = (320 * scale, 240 * scale)
    places = grid_px(20.0 * scale, margin_px=12.0 * scale, size=size_px)
    changed = pad(size_px)
    changed[60 * scale : 130 * scale, 90 * scale : 200 * scale] += [0.1, -0.05, -0.1]
    unit = make_unit(size_px, estimator=random_default())
    still = replace(unit.estimator, layers=scaled(unit.estimator, 0.02))
    blank, frame = (
        in_bytes(dotted(places, 3.0 * scale, image, seed=seed))
        for seed, image in enumerate((pad(size_px), changed))
    )
    unit = replace(unit, estimator=still, background=blank)
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    moved, wanted = (found.gradient.any(-1) for found in (touch, truth))
    assert (moved == wanted).mean() > 0.94
    assert np.abs(touch.gradient - truth.gradient)[moved == wanted].max() < SLOPE
    assert np.abs(truth.gradient).max() > 5 * SLOPE


MARKED, PLAIN = (in_bytes(image) for image in (dotted(grid_px()), pad()))


@pytest.mark.parametrize(
    ("recorded", "blank", "frame", "word"),
    [
        (None, PLAIN, PLAIN, "none"),
        (None, PLAIN, MARKED, "but the blank frame has none"),
        (None, MARKED, MARKED, "but the unit was calibrated without"),
        (None, MARKED, PLAIN, "lost"),
        ({"count": 60.0}, PLAIN, PLAIN, "but the unit has 60"),
        ({"count": 60.0}, MARKED, in_bytes(dotted(grid_px() + 2, seed=1)), "tracked"),
        ({"count": 60.0}, MARKED, PLAIN, "lost"),
    ],
)
def test_the_word_on_dots_is_the_reference_s(recorded, blank, frame, word) -> None:
    unit = make_unit((WIDTH, HEIGHT), markers=recorded)
    touch = FastReconstructor(unit, blank)(frame)
    truth = Reconstructor(unit, blank)(frame)
    assert word in touch.markers
    assert touch.markers == truth.markers
    assert (touch.dots is None) == (truth.dots is None)
    if touch.dots is not None and truth.dots is not None:
        np.testing.assert_array_equal(touch.dots.seen, truth.dots.seen)
        np.testing.assert_allclose(touch.dots.position_px, truth.dots.position_px, atol=1e-3)


def test_of_a_large_frame_s_dents_those_whose_color_changed_are_contacts() -> None:
    size_px, pitch_mm = (322, 242), (0.05, 0.06)  # no whole number of quarters
    unit = make_unit(size_px)
    ball, other = (ball_cap(size_px, (x, 120.0), 2.0, 3.0, pitch_mm) for x in (80.0, 240.0))
    touch = replace(
        FastReconstructor(unit)(unit.background),
        depth_mm=(ball.depth_mm + other.depth_mm).astype(np.float32),
        gradient=(ball.gradient + other.gradient).astype(np.float32),
        disturbed=in_quarters(ball.depth_mm > 0),
    )
    assert 0.9 < touch.contact[ball.depth_mm > 0].mean() <= 1
    assert not touch.contact[ball.depth_mm == 0].any()


@pytest.mark.parametrize("size_px", [(320, 240), (321, 241), (322, 242)])
def test_beside_a_free_border_gel_that_is_not_disturbed_lies_at_zero(size_px) -> None:
    unit = make_unit(size_px)
    touch = FastReconstructor(unit)(pressed(unit.background, (20, 120)))
    assert touch.boundary == "neumann"
    untouched = ~in_pixels(touch.disturbed, size_px)[2::4, 2::4]
    assert np.median(touch.depth_mm[2::4, 2::4][untouched]) == pytest.approx(0, abs=1e-6)
    assert np.ptp(touch.depth_mm) > 0.1


def test_patches_and_shadows_are_the_reference_s() -> None:
    unit = make_unit(lights_deg={"R": 0.0, "G": 120.0, "B": 240.0})
    frame = pressed(unit.background, (50, 60))
    frame[40:80, 110:140] //= 2
    touch, truth = FastReconstructor(unit)(frame), Reconstructor(unit)(frame)
    assert truth.shadow.any() and len(truth.patches) > 0
    assert (touch.shadow == truth.shadow).mean() > 0.99
    assert len(touch.patches) == len(truth.patches)
    for found, wanted in zip(touch.patches, truth.patches, strict=True):
        assert found.deepest_mm == pytest.approx(wanted.deepest_mm, rel=0.01)
        assert found.area_mm2 == pytest.approx(wanted.area_mm2, rel=0.01)


def test_a_frame_is_refused_while_another_thread_s_is_in_work(monkeypatch) -> None:
    unit, refused = make_unit((32, 24)), []
    reconstruct = FastReconstructor(unit)
    take_difference = reconstruct._take_difference
    with ThreadPoolExecutor(1) as other:

        def meanwhile(*arrays: np.ndarray) -> None:
            monkeypatch.setattr(reconstruct, "_take_difference", take_difference)
            refused.append(other.submit(reconstruct, unit.background).exception())
            take_difference(*arrays)

        monkeypatch.setattr(reconstruct, "_take_difference", meanwhile)
        reconstruct(unit.background)
        assert isinstance(refused[0], WedgeError) and "one thread at a time" in str(refused[0])
        with pytest.raises(WedgeError, match="80x60"):
            reconstruct(np.zeros((60, 80, 3), np.uint8))
        assert other.submit(reconstruct, unit.background).result().boundary == "dirichlet"


def test_blank_gel_is_flat_and_untouched() -> None:
    unit = make_unit()
    touch = FastReconstructor(unit)(unit.background)
    assert (touch.contact_mm2, touch.deepest_mm, touch.boundary) == (0, 0, "dirichlet")


def test_a_frame_of_another_size_is_refused() -> None:
    reconstruct = FastReconstructor(make_unit())
    for frame in (np.zeros((60, 80, 3), np.uint8), encode_jpeg(np.zeros((60, 80, 3), np.uint8))):
        with pytest.raises(WedgeError, match="80x60 pixels, not 160x120"):
            reconstruct(frame)


def test_a_frame_leaves_no_memory_behind_and_takes_little() -> None:
    unit = make_unit((320, 240))
    reconstruct = FastReconstructor(unit)
    jpegs = [encode_jpeg(pressed(unit.background, (x, 120), x), 90) for x in (20, 160, 200)]
    for jpeg in jpegs:
        reconstruct(jpeg)
    tracemalloc.start()
    reconstruct(jpegs[0])
    before = tracemalloc.get_traced_memory()[0]
    for jpeg in jpegs * 5:
        reconstruct(jpeg)
    after, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    plane = 4 * 320 * 240
    assert after - before < plane / 10
    assert peak - before < plane


@pytest.mark.parametrize("kind", [Reconstructor, FastReconstructor])
@pytest.mark.parametrize("channels", ["RGB", "R"])
def test_a_grey_background_is_refused_as_a_grey_frame_is(kind: type, channels: str) -> None:
    unit = make_unit((160, 120), channels=channels)
    with pytest.raises(WedgeError, match="the frame is grey, not in colour"):
        kind(unit, np.repeat(unit.background[..., :1], 3, axis=2))
    kind(unit, unit.background * np.array([1, 0, 0], np.uint8))  # of one light, and not grey
