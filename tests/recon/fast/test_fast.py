# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The quick way says what the slow way says, part by part."""

import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon import kernels, unet
from recon.contact.disturbed import boundary_of, disturbed_mask
from recon.estimators import GradientEstimator, gradient_field
from recon.estimators.default import MEMBERS, MEMBERS_OF_FEW, settled
from recon.estimators.mlp import Mlp
from recon.fast import fixed_point, network
from recon.fast.convolution import STEP, CompiledLayers, plane_px, taps
from recon.fast.disturbance import FrameDisturbance, border_of
from recon.fast.ensemble import FrameEnsemble
from recon.fast.network import FrameMlp
from recon.fast.poisson import FrameIntegrator
from recon.fast.still import FrameStill
from recon.fast.unwarping import FrameDifference
from recon.fast.weighing import FrameWeighing
from recon.integration.poisson import Boundary, integrate
from recon.integration.weighed import inferred_doubts, weighed_depth
from recon.quarters import in_pixels, in_quarters
from recon.still import REACH, without_still
from tests.recon.fast.units import (
    CORNERS_PX,
    SLOPE,
    blank_frame,
    make_unit,
    planes,
    pressed,
    random_default,
    random_mlp,
    scaled,
)

X86 = platform.machine() in ("x86_64", "AMD64")


def network_error(network: Mlp, difference: np.ndarray, *, in_words: bool | None) -> float:
    """How far the compiled network is from the network, at most."""
    height, width = difference.shape[:2]
    out = np.full((2, height, width), np.nan, np.float32)
    FrameMlp(network, (width, height), in_words=in_words)(planes(difference), out)
    error = np.moveaxis(out, 0, -1) - gradient_field(network, difference)
    return float(np.abs(error).max())


@settings(max_examples=20)
@given(
    seed=st.integers(0, 99),
    channels=st.sampled_from(["RGB", "RB", "G"]),
    width=st.integers(1, 90),
    spread=st.sampled_from([0.01, 0.1, 1.0]),
)
def test_the_compiled_network_is_the_network(
    seed: int, channels: str, width: int, spread: float
) -> None:
    network = random_mlp(seed, channels)
    difference = np.random.default_rng(seed).normal(0, spread, (3, width, 3)).astype(np.float32)
    assert network_error(network, difference, in_words=False) < SLOPE / 5
    assert network_error(network, difference, in_words=None) < SLOPE


@pytest.mark.skipif(not fixed_point.AVAILABLE, reason="this processor lacks the instructions")
@settings(max_examples=15)
@given(
    seed=st.integers(0, 99),
    gain=st.sampled_from([0.1, 0.5, 1.0]),
    spread=st.sampled_from([0.01, 0.1, 1.0, 100.0]),
)
def test_sixteen_bits_follow_networks_of_any_gain(seed: int, gain: float, spread: float) -> None:
    network = random_mlp(seed)
    layers = tuple((gain * weight, gain * bias) for weight, bias in network.layers)
    network = replace(network, layers=layers)
    difference = np.random.default_rng(seed).normal(0, spread, (8, 64, 3)).astype(np.float32)
    assert network_error(network, difference, in_words=True) < 2 * SLOPE * gain


@pytest.mark.skipif(not fixed_point.AVAILABLE, reason="this processor lacks the instructions")
def test_bits_are_split_as_errs_least(monkeypatch: pytest.MonkeyPatch) -> None:
    splits, layers = network.SPLITS, network._layers(random_mlp())
    errors = []
    for split in splits:
        monkeypatch.setattr(network, "SPLITS", (split,))
        errors.append(network._words(layers, network._float_weights(layers))[1])
    assert len(set(errors)) == len(splits)
    monkeypatch.setattr(network, "SPLITS", splits)
    words, error = network._words(layers, network._float_weights(layers))
    assert error == min(errors) < network.LARGEST_ERROR
    monkeypatch.setattr(network, "SPLITS", (splits[errors.index(error)],))
    best, _ = network._words(layers, network._float_weights(layers))
    assert all(np.array_equal(one, other) for one, other in zip(words, best, strict=True))


@pytest.mark.skipif(not fixed_point.AVAILABLE, reason="this processor lacks the instructions")
def test_where_sixteen_bits_do_not_suffice_floats_are_used() -> None:
    network = random_mlp()
    assert FrameMlp(replace(network, layers=scaled(network, 0.5)), (8, 6)).in_words
    assert not FrameMlp(replace(network, layers=scaled(network, 20)), (8, 6)).in_words


def test_other_processors_go_without_sixteen_bits() -> None:
    code = """
import numpy as np
from recon.estimators import gradient_field
from recon.fast import fixed_point, vectors
from recon.fast.network import FrameMlp
from tests.recon.fast.units import random_mlp
network, out = random_mlp(), np.empty((2, 6, 70), np.float32)
difference = np.random.default_rng(0).normal(0, 0.1, (6, 70, 3)).astype(np.float32)
FrameMlp(network, (70, 6))(np.ascontiguousarray(np.moveaxis(difference, -1, 0)), out)
error = np.abs(np.moveaxis(out, 0, -1) - gradient_field(network, difference)).max()
print(fixed_point.AVAILABLE, vectors.LANES, error < 1e-4)
"""
    # The name too: by it alone LLVM takes this processor to have all that its kind has.
    other = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "+sse2" if X86 else "+neon"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **other},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "False 8 True\n"), done.stderr


@settings(max_examples=15)
@given(
    seed=st.integers(0, 99),
    channels=st.sampled_from(["RGB", "RB", "G"]),
    size_px=st.sampled_from([(90, 40), (33, 70), (9, 9), (600, 480), (481, 502)]),
    drift=st.sampled_from([-0.1, 0.0, 0.02]),
    members=st.sampled_from([MEMBERS, MEMBERS_OF_FEW]),
)
def test_the_compiled_ensemble_is_the_estimator(
    seed: int, channels: str, size_px: tuple, drift: float, members: int
) -> None:
    estimator, (width, height) = random_default(seed, channels, members), size_px
    noise = np.random.default_rng(seed).normal(drift, 0.2, (height, width, 3))
    difference = noise.astype(np.float32)
    network = FrameEnsemble(estimator, size_px)
    out = np.full((2, *network.asked_px[::-1]), np.nan, np.float32)
    network(network.prepared(planes(difference))[0], out)
    out = np.stack([cv2.resize(plane, size_px) for plane in out])
    truth = gradient_field(estimator, difference)
    assert np.abs(np.moveaxis(out, 0, -1) - truth).max() < SLOPE / 2
    assert np.linalg.norm(truth, axis=-1).max() > 0.1


@pytest.mark.parametrize(("asked_px", "side_px"), [((50, 11), 4), ((25, 6), 2)])
def test_slopes_near_a_contact_are_those_of_the_whole_frame(asked_px: tuple, side_px: int) -> None:
    network = FrameEnsemble(random_default(), (50, 11), asked_px)
    difference = np.random.default_rng(0).normal(0, 0.2, (3, 11, 50)).astype(np.float32)
    seen, _ = network.prepared(difference)
    width, height = asked_px
    whole, part = np.full((2, 2, height, width), np.nan, np.float32)
    network(seen, whole)
    near = np.random.default_rng(1).random((3, 13)) < 0.3
    for rows in (slice(0, 5), slice(5, height)):
        network(seen, part, rows, near)
    kept = near.repeat(side_px, 0).repeat(side_px, 1)[:height, :width]
    np.testing.assert_allclose(part, whole * kept, atol=1e-6)
    assert 0 < kept.mean() < 1


@pytest.mark.parametrize("estimator", [random_mlp(), random_default()], ids=lambda e: e.name)
def test_rows_can_be_shared_out(estimator: GradientEstimator) -> None:
    kind = {"mlp": FrameMlp, "default": FrameEnsemble}[estimator.name]
    network = kind(estimator, (50, 11))
    difference = np.random.default_rng(0).normal(0, 0.1, (3, 11, 50)).astype(np.float32)
    seen = network.prepared(difference)[0] if isinstance(network, FrameEnsemble) else difference
    whole, shared = np.full((2, 2, 11, 50), np.nan, np.float32)
    network(seen, whole)
    for rows in (slice(4, 11), slice(3, 4), slice(0, 3)):
        network(seen, shared, rows)
        assert np.isnan(shared[:, : rows.start]).all()  # they are another thread's
    np.testing.assert_allclose(shared, whole, atol=1e-6)


@pytest.mark.parametrize("corners_px", [None, CORNERS_PX])
def test_the_difference_image_is_the_reference_s(corners_px: tuple | None) -> None:
    unwarp = make_unit(corners_px=corners_px).unwarp
    blank, frame = unwarp(blank_frame((160, 120))), blank_frame((160, 120), seed=3)
    out = np.zeros((3, 120, 160), np.float32)
    FrameDifference(unwarp, blank, np.ones(3, np.float32))(frame, out)
    np.testing.assert_array_equal(np.moveaxis(out, 0, -1), unwarp(frame) - blank)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.6, 0.7])
def test_gel_that_does_not_change_beside_a_contact_did_not_drift(share: float) -> None:
    unwarp, blank, frame = make_unit().unwarp, blank_frame((160, 120)), blank_frame((160, 120))
    frame[:, : round(share * 160)] = 0
    difference = np.zeros((3, 120, 160), np.float32)
    FrameDifference(unwarp, unwarp(blank), np.ones(3, np.float32))(frame, difference)
    quick = FrameEnsemble(random_default(), (160, 120)).prepared(difference)[0].settled
    for found in (planes(settled(unwarp(frame) - unwarp(blank))), quick):
        assert not found[..., 150:].any() and found[..., 0].max() < -0.2


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("size_px", [(96, 64), (31, 53), (5, 4), (64, 1), (1, 64)])
def test_the_integrator_solves_the_same_equations(size_px: tuple, boundary: str) -> None:
    width, height = size_px
    gradient = np.random.default_rng(0).normal(size=(height, width, 2))
    pitch_mm = (0.05, 0.08)
    found = FrameIntegrator(size_px, pitch_mm, boundary)
    truth = integrate(gradient, pitch_mm, boundary)
    for _ in range(2):  # what a call leaves behind must not reach the next
        depth = found(planes(gradient.astype(np.float32)))
        assert np.abs(depth - truth).max() < 2e-6 * np.ptp(truth) + 1e-7


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
@pytest.mark.parametrize("size_px", [(190, 131), (96, 64), (5, 4)])
def test_doubted_slopes_count_as_little_as_in_the_reference(
    size_px: tuple, boundary: Boundary, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "recon.integration.weighed.STEPS", 4
    )  # later, rounding errors part them for a while
    width, height = size_px
    random = np.random.default_rng(1)
    pitch_mm = (0.05, 0.08)
    weigh = FrameWeighing(size_px, pitch_mm, boundary)
    for share in (1.0, 0.3):  # what a call leaves behind must not reach the next
        gradient = random.normal(size=(height, width, 2)).astype(np.float32)
        gradient *= random.uniform(size=(height, width, 1)) < share
        free = integrate(gradient, pitch_mm, boundary)
        doubt = random.uniform(0, 0.5, (height, width)).astype(np.float32)
        for unseen in (None, "x", "y"):
            doubts = None if unseen is None else inferred_doubts(gradient, unseen, doubt)
            truth = weighed_depth(free, gradient, pitch_mm, boundary, doubts)
            found = free.copy()
            weigh(planes(gradient), found, None if unseen is None else (unseen, doubt))
            assert np.abs(found - truth).max() < 2e-5 * np.ptp(truth)
        for often in (0.5, 0.01, 0.0):
            rests = random.uniform(size=(height, width)) < often
            truth = weighed_depth(free, gradient, pitch_mm, boundary, rests=rests)
            found = free.copy()
            assert weigh(planes(gradient), found, rests=rests) == rests.any()
            assert np.abs(found - truth).max() < 2e-4 * np.ptp(truth) + 1e-6


def test_disturbed_gel_is_found_where_the_reference_finds_it() -> None:
    background = blank_frame((320, 240))
    find = FrameDisturbance((320, 240), "RGB")
    for center_px in [(160, 120), (90, 150), (20, 120), (300, 230)]:
        frame = pressed(background, center_px)
        difference = ((frame - background.astype(float)) / 255).astype(np.float32)
        quarter, truth = find(planes(difference)), disturbed_mask(difference)
        mask = in_pixels(quarter, (320, 240))
        assert (mask & truth).sum() > 0.85 * (mask | truth).sum()
        assert border_of(quarter) == boundary_of(truth)
    assert not find(np.zeros((3, 240, 320), np.float32)).any()


def test_what_a_disturbance_encloses_or_has_beside_it_is_disturbed_too() -> None:
    """Threads between which colours cancel, and specks of one thing."""
    rows, columns = np.indices((240, 320))
    away = np.hypot(columns - 160, rows - 120)
    difference = np.zeros((240, 320, 3), np.float32)
    difference[(away > 40) & (away < 52)] = 0.3
    difference[120:124, 213:217] = 0.3  # beside the ring
    difference[20:24, 20:24] = 0.3  # alone
    mask = in_pixels(FrameDisturbance((320, 240), "RGB")(planes(difference)), (320, 240))
    truth = disturbed_mask(difference)
    assert truth[120, 160] and truth[122, 215] and not truth[22, 22]
    assert (mask & truth).sum() > 0.9 * (mask | truth).sum()
    assert mask[120, 160] and mask[122, 215] and not mask[22, 22]


@pytest.mark.parametrize(
    ("size_px", "reach"), [((320, 240), 0.06), ((640, 480), REACH), ((641, 487), REACH)]
)
def test_slopes_alone_tell_of_a_contact_where_the_reference_says_so(size_px, reach) -> None:
    network, (width, height) = replace(random_default(), reach=reach), size_px
    weight, bias = network.layers[-1]
    gentle = (weight * np.float32(0.3), bias * np.float32(0.3))
    network = replace(network, layers=(*network.layers[:-1], gentle))
    noise = np.random.default_rng(0).normal(size=(9, 12, 3)).astype(np.float32)
    change = 0.3 * cv2.resize(noise, size_px, interpolation=cv2.INTER_CUBIC)
    nothing = np.zeros((height, width), bool)
    wanted = without_still(gradient_field(network, change), nothing, reach).any(-1)
    quarter = -(-height // 4), -(-width // 4)
    _, small = FrameEnsemble(network, size_px).prepared(planes(change))
    near = FrameStill(network, size_px)(small, np.zeros(quarter, bool))
    found = near.repeat(4, 0).repeat(4, 1)[:height, :width]
    assert near.shape == quarter
    assert 0.1 < wanted.mean() < 0.9
    assert (found == wanted).mean() > 0.94


@given(seed=st.integers(0, 99), height=st.integers(1, 30), width=st.integers(1, 30))
def test_a_quarter_s_pixel_is_set_where_any_of_the_frame_s_is(seed, height, width) -> None:
    mask = np.random.default_rng(seed).random((height, width)) < 0.05
    quarter = in_quarters(mask)
    back = quarter.repeat(4, 0).repeat(4, 1)[:height, :width] > 0
    assert back[mask].all()
    assert in_quarters(back).tolist() == quarter.tolist()
    assert quarter.sum() <= mask.sum()


def test_code_is_compiled_anew_when_a_file_changes_whose_constants_are_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in ("pose/level.py", "estimators/networks.py"):
        (tmp_path / file).parent.mkdir()
        (tmp_path / file).write_text("HIDDEN = (32,)")
    monkeypatch.setattr(kernels, "__file__", str(tmp_path / "kernels.py"))
    before = kernels.code_folder()
    assert kernels.code_folder() == before
    (tmp_path / "estimators" / "networks.py").write_text("HIDDEN = (48,)")
    assert kernels.code_folder() != before


def test_a_new_folder_of_code_takes_the_place_of_those_long_unused(tmp_path: Path) -> None:
    names = ("0" * 12, "1" * 12, "2" * 12, "notes")
    long_unused, used, recent, notes = (tmp_path / name for name in names)
    for folder in (long_unused, used, recent, notes):
        (folder / "deep").mkdir(parents=True)
        (folder / "deep" / "file.nbi").write_text("code")
    file, link = tmp_path / ("3" * 12), tmp_path / ("4" * 12)
    file.write_text("no folder")
    link.symlink_to(notes, target_is_directory=True)
    now_s = link.lstat().st_mtime
    for path in (long_unused, used, recent, notes, file, link):
        days = kernels.UNUSED_DAYS + (-1 if path == recent else 1)
        then_s = now_s - days * kernels.SECONDS_A_DAY
        os.utime(path, (then_s, then_s), follow_symlinks=False)
    assert kernels.prepared(used)  # which was there: nothing is removed
    assert long_unused.exists()
    new = tmp_path / ("5" * 12)
    assert kernels.prepared(new)
    assert set(tmp_path.iterdir()) == {used, recent, notes, file, link, new}
    assert (notes / "deep" / "file.nbi").exists()


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    code = "from recon.kernels import compiled; print(compiled(lambda x: x + 1)(1))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "WEDGE_CACHE": str(tmp_path / "file")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "2\n"), done.stderr


@pytest.mark.parametrize("doubt", [0, 5])
@pytest.mark.parametrize("size_px", [(16, 8), (88, 24)])
def test_a_u_net_s_layers_are_compiled(size_px: tuple[int, int], doubt: int) -> None:
    rng, width, height = np.random.default_rng(0), *size_px
    shapes = unet.layer_shapes((6, 9, 10), fine=(5, 7), doubt=doubt)
    weights = {
        f"{name}.{part}": rng.normal(0, 0.3, shape).astype(np.float32)
        for name, (wide_out, wide_in, side) in shapes.items()
        for part, shape in (("weight", (wide_out, wide_in, side, side)), ("bias", wide_out))
    }
    maps = rng.normal(size=(unet.INPUTS, height, width)).astype(np.float32)
    wanted = unet.through_layers(weights, maps)
    found = unet.through_layers(CompiledLayers(weights), maps)
    np.testing.assert_allclose(found, wanted, atol=1e-4 * np.abs(wanted).max())


@pytest.mark.parametrize("width", range(1, 14))
def test_no_layer_reads_beyond_its_pixels(width: int) -> None:
    for height in range(1, 40):
        plane = plane_px(height, width)
        steps = -(-height * (width + 2) // STEP)
        assert steps * STEP - 1 + taps(1, plane, width + 2).max() // 4 < plane
