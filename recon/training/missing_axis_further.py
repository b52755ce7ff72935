# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the U-Net of the missing gradient axis further, on presses rendered for sensors.

``python -m recon.training.missing_axis_further FIRST --sensor BALLS SETS --out FILE`` goes on from
weights that random surfaces taught (``recon.training.missing_axis``). Half of every step is still
such surfaces; the other half is what calibrated estimators read off rendered frames
(``recon.training.measured_presses``). There errors count in means over squares as well as
singly, since what many neighbours err by alike adds up to depth; a window of untouched gel is among
them, where the answer is to be nothing. What is kept lies between the weights before and after.
Last it teaches the doubt anew (``recon.training.missing_axis_doubt``), as slopes that err less
elsewhere err in other places. Beside FILE each course keeps a checkpoint, from which an interrupted
training goes on; last the losses of both lie there, as .csv and .png, those of the doubt's with
-doubt in their names. It runs on a GPU where there is one, else on one core. Needs torch, the extra
``train``.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from recon import unet
from recon.training.further_courses import (
    between,
    command_of,
    course_parser,
    presses_of,
    settings_of,
)
from recon.training.loss_curve import refuse_weights, write_curve
from recon.training.measured_presses import MeasuredPress, measured_presses
from recon.training.missing_axis import (
    DOUBT_SHARE,
    HUBER_SLOPE,
    STEEPEST_STEP,
    Settings,
    UNet,
    doubt_losses,
    learning_rate,
    print_measures,
    slope_loss,
    training_batch,
)
from recon.training.missing_axis_doubt import LEAST_MOVED_PX, train_doubt
from recon.training.resumable import DEVICE, ResumableTraining, checkpoint_of
from recon.unet.weights import load_weights, save_weights
from sensor.arguments import ending_in_a_sentence
from sensor.extras import how_to_install

try:
    import torch
    from torch import Tensor, nn
    from torch.nn import functional

    from recon.estimators.optimizers import Soap
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

MODULE = "recon.training.missing_axis_further"
STEPS = 4500
SEED = 1  # the first course's is 0
PEAK = 2 / 3
"""Of the first course's learning rate."""
PRESSES_A_STEP = 4
"""Which weigh together, by the gel that moved, as much as a batch of surfaces."""
SIDES_PX = (1, 4, 16)
"""Of the squares over whose means errors count; the longest is the stride of the network."""
UNTOUCHED_PX = (64, 256)
"""Sides of the untouched gel: windows of any size, so that no border is answered with a slope."""
AFTER = 0.7
"""Share of the weights after in those kept: with more of them, crests become too steep, and balls
lose by what shapes gain."""
DOUBT_STEPS = 600


def train_further(
    first: unet.Weights,
    presses: Sequence[MeasuredPress],
    steps: int,
    seed: int,
    share_after: float = AFTER,
    checkpoint: Path | None = None,
) -> tuple[dict[str, np.ndarray], list[float]]:
    """The kept weights, and the loss on rendered presses of every step; progress on stdout.

    Args:
        first: weights before.
        presses: rendered, as sensors measured them.
        steps: batches.
        seed: of surfaces and of the order of presses; not the first course's, whose surfaces
            the network has seen.
        share_after: of the weights after the course in those kept, 0 to 1.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    channels = unet.channels_of(first)
    network = UNet(channels).to(DEVICE)
    network.take(first)
    optimizer = Soap(network.parameters())
    surfaces = Settings(seed=seed, steps=steps, horizon=steps, channels=channels)
    settings = settings_of(seed, first, (press.truth for press in presses))
    training = ResumableTraining(network, optimizer, steps, settings, checkpoint)

    def learn(step: int) -> float:
        optimizer.zero_grad()
        maps, truth = (torch.from_numpy(item).to(DEVICE) for item in training_batch(surfaces, step))
        found = network(maps)
        doubt = doubt_losses(found, truth).mean()
        (slope_loss(found, truth) + DOUBT_SHARE * doubt).backward()
        rng = np.random.default_rng([seed, step, 1])
        chosen = rng.integers(len(presses), size=PRESSES_A_STEP)
        off = [_learn_from(network, presses[index].mirrored(rng)) for index in chosen]
        _learn_from(network, untouched_gel(rng, unet.stride(first)))
        nn.utils.clip_grad_norm_(network.parameters(), STEEPEST_STEP)
        optimizer.step(PEAK * learning_rate(step, steps, steps))
        return float(np.mean(off))

    losses = training.follow(learn)
    return between(first, network.weights(), share_after), losses


def untouched_gel(rng: np.random.Generator, stride: int) -> MeasuredPress:
    """Gel that did not move, seen without noise, in a window of random size."""
    rows, columns = rng.integers(*UNTOUCHED_PX, size=2)
    support = np.zeros((rows + -rows % stride, columns + -columns % stride), np.float32)
    support[:rows, :columns] = 1
    return MeasuredPress(
        maps=np.zeros((unet.INPUTS, *support.shape), np.float32),
        truth=np.zeros((2, *support.shape), np.float32),
        support=support,
    )


def _learn_from(network: UNet, press: MeasuredPress) -> float:
    """Add a press's gradients; its loss."""
    maps, truth = (torch.from_numpy(item[None]).to(DEVICE) for item in (press.maps, press.truth))
    support = torch.from_numpy(press.support).to(DEVICE)
    found: Tensor = network(maps)
    off = _errors(found[:, :2], truth, support)
    doubt = doubt_losses(found, truth).mean()
    ((off + DOUBT_SHARE * doubt) / PRESSES_A_STEP).backward()
    return off.item()


def _errors(found: Tensor, truth: Tensor, support: Tensor) -> Tensor:
    """Of slopes where the gel may have moved, singly and in means over squares."""
    error = (found - truth) * support
    none = torch.zeros((), device=error.device)
    each = [
        side**2
        * functional.huber_loss(means, none.expand_as(means), delta=HUBER_SLOPE, reduction="sum")
        for side, means in ((side, functional.avg_pool2d(error, side)) for side in SIDES_PX)
    ]
    return torch.stack(each).sum() / (2 * max(float(support.sum()), LEAST_MOVED_PX))


def main() -> None:
    """Train, save the weights and print the numbers that their README states."""
    parser = course_parser(MODULE, __doc__, seed=SEED, steps=STEPS)
    parser.add_argument("--after", type=float, default=AFTER, help="share kept of what it learns")
    parser.add_argument("--doubt-steps", type=int, default=DOUBT_STEPS, help="batches after them")
    options = parser.parse_args()
    if min(options.steps, options.doubt_steps) < 2:
        parser.error("--steps and --doubt-steps must be 2 at least")
    if not 0 <= options.after <= 1:
        parser.error("--after is a share, 0 to 1")
    further = f"--after {options.after} --doubt-steps {options.doubt_steps}"
    command = command_of(MODULE, options, further)
    doubt_curve = options.out.with_stem(f"{options.out.stem}-doubt")
    checkpoints = [checkpoint_of(options.out, course) for course in ("further", "doubt")]
    torch.set_num_threads(1)
    with ending_in_a_sentence(parser):
        refuse_weights(options.out)
        refuse_weights(doubt_curve)
        first = load_weights(options.first)
        presses = presses_of(
            options.sensor,
            lambda balls, sets: measured_presses(balls, sets, unet.stride(first), options.seed),
        )
        kept, losses = train_further(
            first, presses, options.steps, options.seed, options.after, checkpoints[0]
        )
        kept, doubts = train_doubt(
            kept, presses, options.doubt_steps, options.seed + 1, checkpoints[1]
        )
        save_weights(options.out, kept, command, options.seed)
        write_curve(options.out, losses)
        write_curve(doubt_curve, doubts)
        for checkpoint in checkpoints:
            checkpoint.unlink(missing_ok=True)
        print_measures(kept)


if __name__ == "__main__":
    main()
