# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the network that tells held gel from gel that follows, on random presses alone.

``python -m recon.training.contact --out FILE`` made the weights from which
``recon.training.contact_further`` went on, twice, to those that ship. Presses are made once from
the seed and seen many times, each time mirrored, turned and measured anew. What is learnt from is
not the skin but what a calibrated sensor would measure of it: slopes that saturate, that are lost
where they are small, and that are wrong over patches of some pixels, and the depth that they
integrate to. An interrupted training goes on from what it keeps beside FILE; it runs on a GPU where
there is one. Needs torch, the extra ``train``.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from recon import unet
from recon.contact.network import CONTACT, network_input
from recon.integration.poisson import integrate
from recon.training.batches import batch_makers, made_ahead
from recon.training.chance import log_uniform
from recon.training.contact_surfaces import surface_gradient
from recon.training.loss_curve import refuse_weights, write_curve
from recon.training.random_presses import random_press
from recon.training.resumable import DEVICE, ResumableTraining, checkpoint_of
from recon.training.torch_layers import UNetLayers
from recon.unet.weights import Purpose, save_weights
from sensor.arguments import at_least, ending_in_a_sentence
from sensor.extras import how_to_install

try:
    import torch
    from torch import Tensor, nn
    from torch.nn import functional
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

CHANNELS = (16, 24, 32, 48)
FRAME_PX = (96, 96)
"""Square: a press is seen in any of its eight mirrored and turned ways."""
FRAMES = 8
PRESSES = 6000
"""Pressed once and kept; each time that one is seen it is measured anew."""
EMPTY_SHARE = 0.03
"""Untouched gel, so that noise alone is answered with none."""
WARM_UP = 0.1  # of the steps
STEEPEST_STEP = 0.5  # norm that the loss's gradient is clipped to
NEAR_PX = 9  # pixels so near to a contact count several times
NEAR_WEIGHT = 5.0
FIRST_SCORE = -3.0  # most of a frame is not held
BATCHES_AHEAD = 12
CUT = 0.02
"""Of the deepest point: a skin deeper than this on the border is cut by it."""
TESTED = 200

Batch = tuple[Float32[np.ndarray, "n maps h w"], Bool[np.ndarray, "n h w"]]


@dataclass(frozen=True, kw_only=True)
class Course:
    """How wrong the slopes are that a part of the training sees, and how fast it learns."""

    lost: float
    """Slopes about as gentle as this come out half as steep, at the worst."""
    bent: float
    """How much less or more of a slope is seen, by where it faces: a deviation."""
    patchy: float
    """How far off slopes are over some pixels, of themselves, at the worst."""
    rate: float


COURSES = (
    Course(lost=0.16, bent=0.06, patchy=0.2, rate=3e-3),
    Course(lost=0.1, bent=0.03, patchy=0.15, rate=1.2e-3),
)
"""The second begins with what the first has learnt."""


class ContactNet(UNetLayers):
    """The network of ``recon.contact.network``, or another for a mask, for training."""

    def __init__(self, channels: tuple[int, ...], purpose: Purpose = CONTACT) -> None:
        super().__init__(channels, purpose.inputs, purpose.outputs, purpose.fine)
        self.fine = len(purpose.fine)
        nn.init.constant_(self.layers["last"].get_parameter("bias"), FIRST_SCORE)

    def forward(self, maps: Float[Tensor, "n maps h w"]) -> Float[Tensor, "n h w"]:
        """Log odds of being held."""
        found = functional.pixel_shuffle(self.layers["out"](self.features(maps)), 2).relu()
        found = torch.cat([maps, found], dim=1)
        for layer in range(self.fine):
            found = self.layers[f"fine{layer}"](found).relu()
        score: Tensor = self.layers["last"](found)[:, 0]
        return score


def measured_gradient(
    rng: np.random.Generator, skin_px: Float32[np.ndarray, "h w"], course: Course
) -> Float32[np.ndarray, "h w 2"]:
    """The slopes of a skin as a random calibrated sensor would measure them, px/px.

    On ball presses of the twin and of real sensors, slopes are a tenth wrong over some pixels,
    steep ones are too low, and those below a twentieth are mostly lost.
    """
    slopes = surface_gradient(skin_px).astype(np.float32)
    blur_px = rng.uniform(0, 1.0)
    if blur_px > 0.3:
        slopes = np.asarray(cv2.GaussianBlur(slopes, (0, 0), blur_px), np.float32)
    steep = np.hypot(slopes[..., 0], slopes[..., 1])
    lost = course.lost * rng.random() ** 2
    most = log_uniform(rng, 0.9, 4.0)
    gain = steep**2 / (steep**2 + lost**2 + 1e-9) / np.sqrt(1 + (steep / most) ** 2)
    gain *= _by_direction(rng, slopes, course.bent)
    slopes *= gain[..., None] * rng.uniform(0.85, 1.1, 2).astype(np.float32)
    steep = np.minimum(steep, 1.5)
    patchy, grain = log_uniform(rng, 0.01, course.patchy), log_uniform(rng, 0.0005, 0.03)
    everywhere = 1 if rng.random() < 0.5 else np.minimum(1, steep / 0.05)
    for axis in (0, 1):
        slopes[..., axis] += patchy * steep * _patches(rng, steep.shape, log_uniform(rng, 0.8, 6.0))
        white = rng.standard_normal((2, *steep.shape), np.float32)
        slopes[..., axis] += patchy / 2 * steep * white[0] + grain * everywhere * white[1]
        if rng.random() < 0.5:
            slopes[..., axis] += rng.uniform(0, 0.015) * _patches(rng, steep.shape, 25.0)
    return slopes


def _by_direction(
    rng: np.random.Generator, slopes: Float32[np.ndarray, "h w 2"], bent: float
) -> Float32[np.ndarray, "h w"]:
    """What lights that are not alike make of slopes that face them and of others."""
    toward = np.arctan2(slopes[..., 1], slopes[..., 0])
    first, second = rng.normal(0, bent, (2, 2))
    return np.asarray(
        1
        + first[0] * np.cos(toward) + first[1] * np.sin(toward)
        + second[0] * np.cos(2 * toward) + second[1] * np.sin(2 * toward),
        np.float32,
    )  # fmt: skip


@lru_cache(maxsize=1)
def presses(
    seed: int, count: int
) -> tuple[Float32[np.ndarray, "n h w"], Bool[np.ndarray, "n h w"]]:
    """So many skins, in pixels, and where they are held."""
    skins = np.empty((count, *FRAME_PX), np.float32)
    touched = np.empty(skins.shape, bool)
    for index in range(count):
        rng = np.random.default_rng([seed, count, index])
        skins[index], touched[index], _ = random_press(rng, *FRAME_PX)
    return skins, touched


def turned(rng: np.random.Generator, maps: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Square maps, all in the same one of eight ways."""
    quarters, mirrored = int(rng.integers(4)), bool(rng.integers(2))
    return [np.rot90(item.T if mirrored else item, quarters).copy() for item in maps]


def training_frame(
    rng: np.random.Generator,
    course: Course,
    skin: Float32[np.ndarray, "h w"],
    touched: Bool[np.ndarray, "h w"],
) -> tuple[np.ndarray, np.ndarray]:
    """The network's input of one press, measured and turned at random, and where it is held."""
    skin, touched = turned(rng, (skin, touched))
    if rng.random() < EMPTY_SHARE:
        skin, touched = np.zeros_like(skin), np.zeros_like(touched)
    slopes = measured_gradient(rng, skin, course)
    border = max(skin[[0, -1]].max(), skin[:, [0, -1]].max())
    if border > CUT * skin.max() > 0:
        depth = integrate(slopes, (1.0, 1.0), "neumann")
        flat = skin < CUT * skin.max()
        depth -= np.median(depth[flat]) if flat.any() else 0
    else:
        depth = integrate(slopes, (1.0, 1.0), "dirichlet")
    return network_input(depth, slopes), touched


def training_batch(seed: int, count: int, course: Course, step: int, frames: int = FRAMES) -> Batch:
    """Inputs and truth of so many frames, of some of so many presses."""
    skins, held = presses(seed, count)
    rng = np.random.default_rng([seed, step])
    chosen = rng.integers(count, size=frames)
    seen = [training_frame(rng, course, skins[i], held[i]) for i in chosen]
    maps, touched = zip(*seen, strict=True)
    return np.stack(maps), np.stack(touched)


def loss_of(score: Float[Tensor, "n h w"], truth: Float[Tensor, "n h w"]) -> Tensor:
    """Entropy, mostly near contacts, and one minus the overlap of each frame's contact."""
    entropy = functional.binary_cross_entropy_with_logits(score, truth, reduction="none")
    near = functional.max_pool2d(truth[:, None], NEAR_PX, 1, NEAR_PX // 2)[:, 0]
    weight = 1 + (NEAR_WEIGHT - 1) * near
    found, some = score.sigmoid(), truth.sum((1, 2)) > 0
    both = (found * truth).sum((1, 2))
    either = (found + truth - found * truth).sum((1, 2)) + 1
    missed = ((1 - both / either) * some).sum() / some.sum().clamp(min=1)
    return 2 * (entropy * weight).sum() / weight.sum() + missed


def learning_rate(course: Course, step: int, steps: int) -> float:
    """Up on a line, down on a cosine to zero."""
    share = step / steps
    rise, fall = (share + 1 / steps) / WARM_UP, (share - WARM_UP) / (1 - WARM_UP)
    return course.rate * min(1.0, rise) * 0.5 * (1 + float(np.cos(np.pi * max(0.0, fall))))


def train(
    seed: int,
    steps: Sequence[int],
    channels: tuple[int, ...],
    executor: Executor,
    *,
    count: int = PRESSES,
    checkpoints: Sequence[Path] = (),
) -> tuple[unet.Weights, list[float]]:
    """The trained weights and the loss of every step; progress on stdout.

    Args:
        seed: of weights, presses and errors.
        steps: of each course.
        channels: feature maps on each level of the U-Net.
        executor: makes the batches.
        count: of presses.
        checkpoints: what is kept of each course on the way, from which it goes on.

    Raises:
        WedgeError: a checkpoint belongs to another training, or cannot be read or written.
    """
    torch.manual_seed(seed)
    network = ContactNet(channels).to(DEVICE)
    losses: list[float] = []
    for number, (course, last) in enumerate(zip(COURSES, steps, strict=True)):
        make = partial(training_batch, seed, count, course)
        losses += follow(
            network,
            course,
            partial(made_ahead, make, executor=executor, ahead=BATCHES_AHEAD),
            last,
            {"seed": seed, "count": count, "steps": steps},
            checkpoints[number] if checkpoints else None,
        )
    return network.weights(), losses


def follow(
    network: ContactNet,
    course: Course,
    make: Callable[[range], Iterable[Batch]],
    steps: int,
    settings: Mapping[str, object],
    checkpoint: Path | None = None,
) -> list[float]:
    """Teach a network a course; the loss of every step, progress on stdout.

    Args:
        network: on ``DEVICE``; changed.
        course: how fast it learns.
        make: the batches of those steps.
        steps: of the course.
        settings: what else decides the weights.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # torch's stubs
    optimizer = torch.optim.Adam(network.parameters())
    settings = {**settings, "course": asdict(course)}
    training = ResumableTraining(network, optimizer, steps, settings, checkpoint)
    batches = iter(make(training.left))

    def learn(step: int) -> float:
        maps, truth = (torch.from_numpy(values).to(DEVICE) for values in next(batches))
        for group in optimizer.param_groups:
            group["lr"] = learning_rate(course, step, steps)
        score = network(maps.to(memory_format=torch.channels_last))
        loss = loss_of(score, truth.float())
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), STEEPEST_STEP)
        optimizer.step()
        return loss.item()

    return training.follow(learn)


def overlap_on_fresh_presses(weights: unet.Weights, count: int, seed: int) -> float:
    """Mean intersection over union with the truth of presses that nobody learnt from."""
    rng = np.random.default_rng([seed, 2**31])
    found = []
    for _ in range(count):
        skin, touched, _ = random_press(rng, *FRAME_PX)
        maps, truth = training_frame(rng, COURSES[-1], skin, touched)
        if truth.any():
            mask = unet.through_layers(weights, maps)[0] > 0
            found.append((mask & truth).sum() / (mask | truth).sum())
    return float(np.mean(found))


def main() -> None:
    """Train, save the weights and the loss, and print the overlap on fresh presses."""
    parser = argparse.ArgumentParser(prog="python -m recon.training.contact", description=__doc__)
    parser.add_argument("--seed", type=at_least(0), default=0)
    parser.add_argument("--steps", default="7000,1800", help="batches of each course")
    parser.add_argument("--channels", default=",".join(map(str, CHANNELS)))
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    options = parser.parse_args()
    try:
        channels, steps = (
            tuple(int(count) for count in text.split(","))
            for text in (options.channels, options.steps)
        )
    except ValueError:
        parser.error("--steps and --channels must be whole numbers with commas between them")
    if len(steps) != len(COURSES) or min(steps) < 2 or len(channels) < 2 or min(channels) < 1:
        parser.error("--steps needs two numbers from 2 up, --channels two or more from 1 up")
    command = (
        f"python -m recon.training.contact --seed {options.seed} --steps {options.steps} "
        f"--channels {','.join(map(str, channels))} --out {options.out.name}"
    )
    checkpoints = [checkpoint_of(options.out, f"course-{number}") for number in (1, 2)]
    torch.set_num_threads(1)
    with ending_in_a_sentence(parser):
        refuse_weights(options.out)
        with batch_makers(1) as executor:
            weights, losses = train(
                options.seed, steps, channels, executor, checkpoints=checkpoints
            )
        save_weights(options.out, weights, command, options.seed, CONTACT)
        write_curve(options.out, losses)
        for checkpoint in checkpoints:
            checkpoint.unlink(missing_ok=True)
        overlap = overlap_on_fresh_presses(weights, TESTED, options.seed)
        print(f"overlap with the truth on {TESTED} fresh presses: {overlap:.3f}")


def _patches(
    rng: np.random.Generator, shape: tuple[int, ...], length_px: float
) -> Float32[np.ndarray, "h w"]:
    """Smooth noise of deviation 1, made at half the resolution."""
    height, width = shape
    noise = rng.standard_normal((height // 2 + 1, width // 2 + 1), np.float32)
    smooth = cv2.resize(cv2.GaussianBlur(noise, (0, 0), length_px / 2), (width, height))
    return np.asarray(smooth / max(float(smooth.std()), 1e-6), np.float32)


if __name__ == "__main__":
    main()
