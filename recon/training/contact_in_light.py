# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the contact's network that knows how one design is lit, on presses rendered for it.

``python -m recon.training.contact_in_light BALLS SETS --out FILE`` made the weights that ship for
the standard design: BALLS is a dataset of the twin's labelled balls, by which ``default`` is
calibrated, and SETS are rendered by ``benchmarks.rendered_presses``, parts, odd things and dies.
Every twelfth press is left out, and tells at the end how well the mask fits. The design is its own
mirror image along y if red and blue change places, so every press is seen both ways. An interrupted
training goes on from the checkpoint beside FILE; it runs on a GPU where there is one. Needs torch,
the extra ``train``.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float16, Float32, Float64

from recon import unet
from recon.contact.known_light import CONTACT_IN_LIGHT, PITCH_MM, light_input
from recon.estimators import GradientEstimator, fit_estimator, lesson_of
from recon.estimators.default import Default
from recon.estimators.shading import blank_colors
from recon.pixels import positions
from recon.presses import read_presses
from recon.training.contact import Batch, ContactNet, Course, follow
from recon.training.felt_presses import presses_that_show, read_by
from recon.training.further_courses import digest_of
from recon.training.loss_curve import refuse_weights, write_curve
from recon.training.resumable import DEVICE, checkpoint_of
from recon.unet.weights import save_weights
from sensor.arguments import at_least, ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.extras import how_to_install

try:
    import torch
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

MODULE = "recon.training.contact_in_light"
CHANNELS = (24, 32, 48, 64)
STEPS = 9000
FRAMES = 12
"""In every step."""
SIDE_PX = 96
ASIDE_PX = 30
"""How far from the middle of what is seen a pixel that is held may lie."""
COURSE = Course(lost=0.0, bent=0.0, patchy=0.0, rate=3e-3)
CALIBRATIONS = ((1, 0), (1, 1), (2, 2))
"""Of ``default``: with every so many-th ball, and a number to add to the seed."""
LEFT_OUT = 12
"""Of so many presses one is not learnt from."""
SMALL_PX, SMALL_MORE = 1500, 0.25
"""Contacts of fewer pixels are seen more often, by this power of how much smaller they are."""
GAIN, STEEPER = 0.04, 0.05
"""Deviation of each colour's, and how much steeper or gentler slopes may be."""
NOISE, STAINS, STAINS_ACROSS = 0.01, 0.008, 3
"""Deviations at the most, in shares of full scale."""


@dataclass(frozen=True, kw_only=True)
class LitPress:
    """One press as the camera sees it, and as several calibrations of ``default`` read it."""

    difference: Float16[np.ndarray, "h w 3"]
    gradient: Float16[np.ndarray, "k h w 2"]
    depth_px: Float16[np.ndarray, "k h w"]
    held: Bool[np.ndarray, "h w"]


def lit_presses(
    sensors: Sequence[GradientEstimator], rendered: Sequence[Path]
) -> Iterator[LitPress]:
    """Each press of some sets; those that no colour tells of are left out.

    Args:
        sensors: calibrated with balls of the same twin.
        rendered: datasets that know where the gel is held.

    Raises:
        WedgeError: a dataset cannot be used, does not know where the gel is held, or has pixels of
            another pitch than the network is made for.
    """
    for folder in rendered:
        for press, held in presses_that_show(folder):
            if not np.allclose(press.mm_per_px, PITCH_MM, rtol=0.01):
                raise WedgeError(f"{folder} is not of the standard design, 320 pixels wide.")
            touches = list(read_by(sensors, press))
            yield LitPress(
                difference=press.difference.astype(np.float16),
                gradient=np.stack([touch.gradient for touch in touches]).astype(np.float16),
                depth_px=np.stack([touch.depth_mm / PITCH_MM for touch in touches]).astype(
                    np.float16
                ),
                held=held,
            )


def mirrored(press: LitPress) -> LitPress:
    """The press the other way round along y, red where blue is."""
    return LitPress(
        difference=press.difference[::-1, :, ::-1],
        gradient=press.gradient[:, ::-1] * np.array([1, -1], np.float16),
        depth_px=press.depth_px[:, ::-1],
        held=press.held[::-1],
    )


@dataclass(frozen=True, kw_only=True)
class Pad:
    """What all presses share."""

    blank: Float32[np.ndarray, "h w 3"]
    """Colours of the blank gel."""
    position: Float32[np.ndarray, "h w 2"]
    """-1 to 1 from edge to edge."""


def pad_of(sensor: Default, press: LitPress) -> Pad:
    """The pad that the presses of a sensor lie on."""
    where = positions(press.held.shape[::-1])
    blank = blank_colors(sensor.light, where.reshape(-1, 2))
    return Pad(blank=blank.reshape(*where.shape[:2], 3), position=where)


def how_often(presses: Sequence[LitPress]) -> Float64[np.ndarray, " presses"]:
    """How probable each press is to be seen: small contacts more often than large ones."""
    area_px = np.minimum([press.held.sum() for press in presses], SMALL_PX)
    often = area_px**-SMALL_MORE
    return np.asarray(often / often.sum())


def lit_batch(
    presses: Sequence[LitPress],
    often: Float64[np.ndarray, " presses"],
    pad: Pad,
    seed: int,
    step: int,
) -> Batch:
    """Inputs and truth of some presses, each seen a little otherwise."""
    rng = np.random.default_rng([seed, step])
    chosen = rng.choice(len(presses), FRAMES, p=often)
    maps, truth = zip(*(_seen(rng, presses[index], pad) for index in chosen), strict=True)
    return np.stack(maps), np.stack(truth)


def _seen(
    rng: np.random.Generator, press: LitPress, pad: Pad
) -> tuple[Float32[np.ndarray, "9 side side"], Bool[np.ndarray, "side side"]]:
    """A square at a contact, by one calibration, in colours as they drift and grain as it comes."""
    calibration = int(rng.integers(len(press.gradient)))
    places = np.flatnonzero(press.held)
    middle = np.array(divmod(int(rng.choice(places)), press.held.shape[1]))
    middle += rng.integers(-ASIDE_PX, ASIDE_PX + 1, 2)
    first = np.clip(middle - SIDE_PX // 2, 0, np.subtract(press.held.shape, SIDE_PX))
    rows, columns = (slice(int(at), int(at) + SIDE_PX) for at in first)
    square = LitPress(
        difference=press.difference[rows, columns],
        gradient=press.gradient[calibration : calibration + 1, rows, columns],
        depth_px=press.depth_px[calibration : calibration + 1, rows, columns],
        held=press.held[rows, columns],
    )
    if rng.random() < 0.5:
        square = mirrored(square)
        rows = slice(len(pad.blank) - rows.stop, len(pad.blank) - rows.start)
    difference = square.difference.astype(np.float32)
    difference *= 1 + np.float32(GAIN) * rng.standard_normal(3, np.float32)
    grain = rng.standard_normal(difference.shape, np.float32)
    difference += np.float32(rng.uniform(0, NOISE)) * grain
    stains = rng.standard_normal((STAINS_ACROSS, STAINS_ACROSS, 3), np.float32)
    spread = cv2.resize(stains, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_CUBIC)
    difference += np.float32(rng.uniform(0, STAINS)) * spread
    steeper = np.float32(rng.uniform(1 - STEEPER, 1 + STEEPER))
    maps = light_input(
        difference,
        pad.blank[rows, columns],
        pad.position[rows, columns],
        square.depth_px[0].astype(np.float32) * steeper,
        square.gradient[0].astype(np.float32) * steeper,
    )
    return maps, square.held.copy()


def train(
    presses: Sequence[LitPress], pad: Pad, steps: int, seed: int, checkpoint: Path | None = None
) -> tuple[unet.Weights, list[float]]:
    """The trained weights and the loss of every step; progress on stdout.

    Args:
        presses: to learn from.
        pad: that they lie on.
        steps: batches.
        seed: of weights, order and drift.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    torch.manual_seed(seed)
    network = ContactNet(CHANNELS, CONTACT_IN_LIGHT).to(DEVICE)
    make = partial(map, partial(lit_batch, presses, how_often(presses), pad, seed))
    settings = {"seed": seed, "presses": digest_of(press.held for press in presses)}
    losses = follow(network, COURSE, make, steps, settings, checkpoint)
    return network.weights(), losses


def overlap(weights: unet.Weights, presses: Sequence[LitPress], pad: Pad) -> float:
    """Mean intersection over union with the truth, as the first calibration reads the presses."""
    found = []
    for press in presses:
        maps = light_input(
            press.difference.astype(np.float32),
            pad.blank,
            pad.position,
            press.depth_px[0].astype(np.float32),
            press.gradient[0].astype(np.float32),
        )
        mask = unet.through_layers(weights, maps)[0] > 0
        found.append((mask & press.held).sum() / (mask | press.held).sum())
    return float(np.mean(found))


def _calibrated(balls: Path, seed: int) -> list[Default]:
    labelled = read_presses(read_dataset(balls)).presses
    sensors = []
    for step, further in CALIBRATIONS:
        lesson = lesson_of(Default.name, labelled, range(0, len(labelled), step), seed + further)
        fitted = fit_estimator(Default.name, lesson, "RGB", seed + further)
        assert isinstance(fitted, Default)
        sensors.append(fitted)
    return sensors


def main() -> None:
    """Train, save the weights and the loss, and print the overlap on the presses left out."""
    parser = argparse.ArgumentParser(prog=f"python -m {MODULE}", description=__doc__)
    parser.add_argument("balls", type=Path, help="a dataset of the twin's labelled balls")
    parser.add_argument("sets", type=Path, nargs="+", help="of rendered presses on that twin")
    parser.add_argument("--seed", type=at_least(0), default=0)
    parser.add_argument("--steps", type=at_least(2), default=STEPS, help="batches")
    parser.add_argument("--threads", type=at_least(1), default=1, help="that torch uses")
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    options = parser.parse_args()
    sets = " ".join(folder.name for folder in (options.balls, *options.sets))
    counts = f"--seed {options.seed} --steps {options.steps} --threads {options.threads}"
    command = f"python -m {MODULE} {sets} {counts} --out {options.out.name}"
    torch.set_num_threads(options.threads)
    with ending_in_a_sentence(parser):
        refuse_weights(options.out)
        sensors = _calibrated(options.balls, options.seed)
        presses = list(lit_presses(sensors, options.sets))
        if not presses:
            raise WedgeError("no press changes a colour: name sets of rendered presses.")
        tested = presses[::LEFT_OUT]
        taught = [press for at, press in enumerate(presses) if at % LEFT_OUT]
        print(f"{len(taught)} presses to learn from, {len(tested)} left out", flush=True)
        pad = pad_of(sensors[0], presses[0])
        checkpoint = checkpoint_of(options.out)
        weights, losses = train(taught, pad, options.steps, options.seed, checkpoint)
        save_weights(options.out, weights, command, options.seed, CONTACT_IN_LIGHT)
        write_curve(options.out, losses)
        checkpoint.unlink(missing_ok=True)
        print(f"overlap on the presses left out: {overlap(weights, tested, pad):.3f}")


if __name__ == "__main__":
    main()
