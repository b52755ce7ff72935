# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""JPEG bytes to depth in mm: time against the floor and against plain torch, and agreement.

The floor is what no way of doing it can leave out: decoding, one remap, one cosine transform and
its inverse. Times are processor time of the thread, which a busy machine disturbs least, taken in
turn over real presses coded as JPEGs; only what two threads do is told by the clock.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from statistics import median

import cv2
import numpy as np
from scipy import fft

from benchmarks.measurement import Measurement, one_thread
from recon.arrays import Frame
from recon.calibration import CHANNELS, Calibration
from recon.estimators.default import MEMBERS, MEMBERS_OF_FEW, SLOPE_KNOTS, Default
from recon.estimators.lean import FLAT
from recon.estimators.mlp import Mlp
from recon.estimators.networks import HIDDEN
from recon.estimators.shading import LIGHT_POWERS
from recon.estimators.surroundings import ASPECTS
from recon.fast import FastReconstructor
from recon.pipeline import Reconstructor
from recon.pixels import positions
from recon.stream.jpeg import decode_jpeg, encode_jpeg

ROUNDS = 6
QUALITY = 85
JPEGS = 10
DOTS, DOT_RADIUS = 18, 0.2
"""Along a row, and the share of their spacing."""
LARGE, SMALL = (640, 480), (320, 240)
Step = Callable[[bytes], object]


def measure(
    unit: Calibration, frames: Sequence[Frame], two_lights: tuple[Calibration, Sequence[Frame]]
) -> Iterator[Measurement]:
    """Every figure of the fast path, for a unit with the paper's network and frames of it.

    Args:
        unit: with the paper's network.
        frames: of it.
        two_lights: a unit with our estimator and lights on one axis alone, and frames of it. What
            its slopes are tells in its time, as a contact that seems cut is mirrored.
    """
    with one_thread():
        yield from _agreement(unit, frames)
        for size_px in (LARGE, SMALL):
            yield from _times(*resized(unit, frames, size_px), size_px)
            yield _ours("red and blue alone", *resized(*two_lights, size_px), size_px)


def resized(
    unit: Calibration, frames: Sequence[Frame], size_px: tuple[int, int]
) -> tuple[Calibration, list[bytes]]:
    """The unit as if its camera had another size, and its frames as JPEGs."""
    pitch_mm = tuple(
        pitch * old / new
        for pitch, old, new in zip(unit.card.mm_per_px, unit.card.size_px, size_px, strict=True)
    )
    card = replace(
        unit.card, frame_size_px=size_px, size_px=size_px, mm_per_px=(pitch_mm[0], pitch_mm[1])
    )
    small = replace(unit, card=card, background=_scaled(unit.background, size_px))
    chosen = frames[:: max(1, len(frames) // JPEGS)]
    return small, [encode_jpeg(_scaled(frame, size_px), QUALITY) for frame in chosen]


def _agreement(unit: Calibration, frames: Sequence[Frame]) -> Iterator[Measurement]:
    unit, jpegs = resized(unit, frames, LARGE)
    quick, reference = FastReconstructor(unit), Reconstructor(unit)
    worst, same = 0.0, 0
    for jpeg in jpegs:
        touch, truth = quick(jpeg), reference(decode_jpeg(jpeg))
        worst = max(worst, float(np.abs(touch.gradient - truth.gradient).max()))
        same += touch.boundary == truth.boundary
    name = f"fast path: largest difference in slope from the reference, {len(jpegs)} frames"
    yield Measurement(name=name, value=worst, unit="mm/mm", bar=1e-3)
    yield Measurement(
        name="fast path: frames for which it chooses another border",
        value=1 - same / len(jpegs),
        unit=f"of {len(jpegs)}",
    )


def _times(
    unit: Calibration, jpegs: Sequence[bytes], size_px: tuple[int, int]
) -> Iterator[Measurement]:
    size = "x".join(map(str, size_px))
    quick = FastReconstructor(unit)
    fast, floor = _taken_ms([quick, _floor(size_px)], jpegs, ROUNDS)
    large = size_px == LARGE
    yield Measurement(
        name=f"fast path: {size} JPEG to depth against its floor, one thread",
        value=median(fast) / median(floor),
        unit=f"ratio ({median(floor):.1f} ms floor)",
        bar=3.0 if large else None,
    )
    yield Measurement(
        name=f"fast path: {size} JPEG to depth, one thread",
        value=median(fast),
        unit=f"ms ({1e3 / median(fast):.0f} frames/s)",
        bar=1e3 / 60 if large else 1e3 / 200,
    )
    yield Measurement(
        name=f"fast path: {size}, 95th percentile against median",
        value=float(np.percentile(fast, 95)) / median(fast),
        unit="ratio",
        bar=1.5,
    )
    for where, ours, seen in (
        ("these presses", replace(unit, estimator=_default(0.02)), jpegs),
        ("all of the gel pressed", replace(unit, estimator=_default(1.0)), jpegs),
        ("taught by few", replace(unit, estimator=_default(0.02, members=MEMBERS_OF_FEW)), jpegs),
        ("dots at rest", *_dotted(replace(unit, estimator=_default(0.02)), jpegs)),
    ):
        yield _ours(where, ours, seen, size_px)
    if large:
        plain = _plain_torch(unit)
        slow, again = _taken_ms([plain, quick], jpegs[:3], 2)
        yield Measurement(
            name=f"fast path: {size} against the paper's network in plain torch with a DST",
            value=median(again) / median(slow),
            unit=f"ratio ({median(slow):.0f} ms)",
            bar=1 / 8,
        )
        two = FastReconstructor(unit, threads=2)
        one_ms, two_ms = _taken_ms([quick, two], jpegs, ROUNDS, time.perf_counter)
        yield Measurement(
            name=f"fast path: {size}, two threads against one, by the clock",
            value=median(two_ms) / median(one_ms),
            unit=f"ratio ({median(two_ms):.1f} ms)",
        )


def _ours(
    where: str, unit: Calibration, jpegs: Sequence[bytes], size_px: tuple[int, int]
) -> Measurement:
    size = "x".join(map(str, size_px))
    taken, floor = _taken_ms([FastReconstructor(unit), _floor(size_px)], jpegs, ROUNDS)
    return Measurement(
        name=f"fast path: {size} JPEG to depth by our estimator, {where}, against its floor",
        value=median(taken) / median(floor),
        unit=f"ratio ({median(taken):.1f} ms, {1e3 / median(taken):.0f} frames/s)",
    )


def _taken_ms(
    steps: Sequence[Step],
    jpegs: Sequence[bytes],
    rounds: int,
    clock: Callable[[], float] = time.thread_time,
) -> list[list[float]]:
    """Times of each step on every frame, taken in turn."""
    taken: list[list[float]] = [[] for _ in steps]
    for step in steps:
        step(jpegs[0])
    for _ in range(rounds):
        for jpeg in jpegs:
            for step, times in zip(steps, taken, strict=True):
                start = clock()
                step(jpeg)
                times.append(1e3 * (clock() - start))
    return taken


def _floor(size_px: tuple[int, int]) -> Step:
    width, height = size_px
    frame, out = np.empty((2, height, width, 3), np.uint8)
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height) * 1.0)
    maps = columns * 0.95 + 3, rows.astype(np.float32) * 0.95 + 3
    plane = np.random.default_rng(0).normal(size=(height, width)).astype(np.float32)

    def floor(jpeg: bytes) -> object:
        decode_jpeg(jpeg, frame)
        cv2.remap(frame, *maps, cv2.INTER_LINEAR, dst=out)
        return fft.idctn(fft.dctn(plane))

    return floor


def _dotted(unit: Calibration, jpegs: Sequence[bytes]) -> tuple[Calibration, list[bytes]]:
    """The unit and its frames as if its gel had dots, which no press moves."""
    width, height = unit.card.size_px
    y, x = (np.indices((height, width)) * (DOTS / width) + 0.5) % 1 - 0.5
    dots = np.where(np.hypot(x, y) < DOT_RADIUS, 0.3, 1.0)
    shade = cv2.GaussianBlur(dots, (0, 0), 1.0)[..., None]

    def spoilt(frame: Frame) -> Frame:
        return np.round(frame * shade).astype(np.uint8)

    gel = replace(unit, background=spoilt(unit.background))
    return gel, [encode_jpeg(spoilt(decode_jpeg(jpeg)), QUALITY) for jpeg in jpegs]


def _default(gain: float, members: int = MEMBERS) -> Default:
    """Our estimator with weights of no unit: only how far its slopes reach tells in its time."""
    random, count = np.random.default_rng(0), len(CHANNELS)
    features = (2 + ASPECTS) * count + 2
    layers = tuple(
        (
            random.normal(0, (gain if m == 2 else 1) / np.sqrt(n), (members, n, m)).astype("f4"),
            np.zeros((members, m), np.float32),
        )
        for n, m in pairwise((features, *HIDDEN, 2))
    )
    return Default(
        channels=CHANNELS,
        light=np.full((len(LIGHT_POWERS), count), 0.05, np.float32),
        mean=np.zeros(features, np.float32),
        spread=np.full(features, 0.1, np.float32),
        layers=layers,
        gel=FLAT,
        error90=np.zeros((len(SLOPE_KNOTS), 2), np.float32),
    )


def _plain_torch(unit: Calibration) -> Step:
    """What a first implementation does: the whole frame through the network, a sine transform."""
    import torch

    network = unit.estimator
    assert isinstance(network, Mlp)
    layers = [(torch.from_numpy(weight), torch.from_numpy(bias)) for weight, bias in network.layers]
    width, height = unit.card.size_px
    position = positions((width, height)).reshape(-1, 2)
    blank = unit.background.astype(np.float32) / 255
    k, m = np.arange(1, height + 1), np.arange(1, width + 1)
    values = 2 * np.cos(np.pi * k / (height + 1))[:, None] - 4
    values = values + 2 * np.cos(np.pi * m / (width + 1))
    torch.set_num_threads(1)

    def plain(jpeg: bytes) -> object:
        difference = decode_jpeg(jpeg).astype(np.float32) / 255 - blank
        seen = torch.from_numpy(network.inputs(difference.reshape(-1, 3), position))
        for weight, bias in layers[:-1]:
            seen = torch.tanh(seen @ weight + bias)
        weight, bias = layers[-1]
        gradient = (seen @ weight + bias).numpy().reshape(height, width, 2)
        divergence = np.gradient(gradient[..., 0], axis=1) + np.gradient(gradient[..., 1], axis=0)
        return fft.idstn(fft.dstn(divergence, type=1) / values, type=1) * unit.card.mm_per_px[0]

    return plain


def _scaled(frame: Frame, size_px: tuple[int, int]) -> Frame:
    scaled: Frame = np.asarray(cv2.resize(frame, size_px, interpolation=cv2.INTER_AREA))
    return scaled
