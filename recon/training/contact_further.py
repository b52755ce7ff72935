# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the contact's network further, on presses rendered for sensors.

``python -m recon.training.contact_further FIRST --sensor BALLS SETS --out FILE`` goes on from
weights that random presses taught (``recon.training.contact``). A quarter of every step is still
such presses; the rest is what calibrated estimators read off rendered frames
(``recon.training.felt_presses``). What is kept lies between the weights before and after. An
interrupted training goes on from the checkpoint beside FILE; it runs on a GPU where there is one.
Needs torch, the extra ``train``.
"""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from recon import unet
from recon.contact.network import CONTACT
from recon.training.contact import (
    COURSES,
    FRAME_PX,
    TESTED,
    Batch,
    ContactNet,
    follow,
    overlap_on_fresh_presses,
    training_batch,
)
from recon.training.felt_presses import FeltPress, felt_presses, seen_anew
from recon.training.further_courses import (
    between,
    command_of,
    course_parser,
    presses_of,
    settings_of,
)
from recon.training.loss_curve import refuse_weights, write_curve
from recon.training.resumable import DEVICE, checkpoint_of
from recon.unet.weights import load_weights, save_weights
from sensor.arguments import ending_in_a_sentence
from sensor.extras import how_to_install

try:
    import torch
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

MODULE = "recon.training.contact_further"
STEPS = 6000
SEED = 1  # the first courses' is 0
COURSE = COURSES[-1]
RANDOM_FRAMES, FELT_FRAMES = 2, 6
"""In every step."""
PRESSES = 1500
"""Random ones, pressed once and measured anew each time."""
AFTER = 0.35
"""Share of the weights after in those kept: with more of them, sharp ridges read without an error
are taken for the gel beside their crest."""


def train_further(
    first: unet.Weights,
    presses: Sequence[FeltPress],
    steps: int,
    seed: int,
    checkpoint: Path | None = None,
) -> tuple[unet.Weights, list[float]]:
    """The kept weights and the loss of every step; progress on stdout.

    Args:
        first: weights before.
        presses: rendered, as sensors measured them.
        steps: batches.
        seed: of random presses and of the order of rendered ones; not the first courses', whose
            presses the network has seen.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    network = ContactNet(unet.channels_of(first)).to(DEVICE)
    network.take(first)
    make = partial(further_batch, presses, seed)
    settings = settings_of(seed, first, (press.held for press in presses))
    losses = follow(network, COURSE, partial(map, make), steps, settings, checkpoint)
    return between(first, network.weights(), AFTER), losses


def further_batch(presses: Sequence[FeltPress], seed: int, step: int) -> Batch:
    """Inputs and truth of random presses and of rendered ones."""
    maps, truth = training_batch(seed, PRESSES, COURSE, step, RANDOM_FRAMES)
    rng = np.random.default_rng([seed, step, 1])
    chosen = rng.integers(len(presses), size=FELT_FRAMES)
    felt = [seen_anew(rng, presses[index], FRAME_PX[0]) for index in chosen]
    seen, held = zip(*felt, strict=True)
    return np.concatenate([maps, np.stack(seen)]), np.concatenate([truth, np.stack(held)])


def main() -> None:
    """Train, save the weights and the loss, and print the overlap on fresh presses."""
    parser = course_parser(MODULE, __doc__, seed=SEED, steps=STEPS)
    options = parser.parse_args()
    if options.steps < 2:
        parser.error("--steps must be 2 at least")
    command = command_of(MODULE, options)
    checkpoint = checkpoint_of(options.out)
    torch.set_num_threads(1)
    with ending_in_a_sentence(parser):
        refuse_weights(options.out)
        first = load_weights(options.first, CONTACT)
        presses = presses_of(
            options.sensor, lambda balls, sets: felt_presses(balls, sets, options.seed)
        )
        weights, losses = train_further(first, presses, options.steps, options.seed, checkpoint)
        save_weights(options.out, weights, command, options.seed, CONTACT)
        write_curve(options.out, losses)
        checkpoint.unlink(missing_ok=True)
        overlap = overlap_on_fresh_presses(weights, TESTED, options.seed)
        print(f"overlap with the truth on {TESTED} fresh presses: {overlap:.3f}")


if __name__ == "__main__":
    main()
