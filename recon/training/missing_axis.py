# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the U-Net of the missing gradient axis on random surfaces alone.

``python -m recon.training.missing_axis --out FILE`` made the weights from which
``recon.training.missing_axis_further`` went on to those that ship. Every batch is drawn anew from
the seed, so that no surface is seen twice and none needs storing. Beside FILE it keeps a
checkpoint, from which an interrupted training goes on, and last the loss as FILE.csv and FILE.png.
It runs on a GPU where there is one, else on one core. Needs torch, the extra ``train``.
"""

import argparse
import sys
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32

from recon import unet
from recon.lights import Axis
from recon.missing_axis.inference import infer_missing_axis
from recon.training.batches import batch_makers, made_ahead
from recon.training.contact_surfaces import surface_gradient
from recon.training.few_lights import measure
from recon.training.loss_curve import refuse_weights, write_curve
from recon.training.random_balls import SQUARE, random_ball
from recon.training.random_surfaces import RECIPES, Recipe
from recon.training.resumable import DEVICE, ResumableTraining, checkpoint_of
from recon.training.torch_layers import UNetLayers
from recon.unet.weights import save_weights
from sensor.arguments import at_least, ending_in_a_sentence, some_of
from sensor.extras import how_to_install

try:
    import torch
    from torch import Tensor, nn
    from torch.nn import functional

    from recon.estimators.optimizers import Soap
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

SMALL_PX, SMALL_FRAMES = (96, 128), 8
LARGE_PX, LARGE_FRAMES = (224, 320), 3  # a frame in use, so that large contacts are learnt as well
LARGE_SHARE = 0.05  # of the batches
PAPER_SHARE = 0.3  # of the surfaces, where both recipes are drawn from
LEARNING_RATE = 3e-3
WARM_UP = 0.15  # of the horizon
LAST_FALL = 0.2  # of the steps
HUBER_SLOPE = 0.1  # errors below it count squared, above it linearly: a rim is no outlier
DOUBT_SHARE = 0.01  # of the loss: the doubt must not distract from the slopes
FIRST_LOG_DOUBT = -4.0  # most of a frame is flat
STEEPEST_STEP = 0.5  # norm that the loss's gradient is clipped to
BATCHES_AHEAD = 16
TEST_NOISE = 0.04

Batch = tuple[Float32[np.ndarray, "n 3 h w"], Float32[np.ndarray, "n 2 h w"]]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What decides the weights: the same settings give the same network on the same machine."""

    seed: int = 0
    """Of the first weights and of every surface and sensor."""
    steps: int
    """Batches."""
    horizon: int
    """Steps over which the learning rate would fall to zero; where that is beyond ``steps``, it
    falls faster over the last fifth of them."""
    channels: tuple[int, ...] = unet.CHANNELS
    recipes: tuple[Recipe, ...] = ("paper", "contact")

    @property
    def arguments(self) -> str:
        """The words on the command line that give these settings."""
        return (
            f"--seed {self.seed} --steps {self.steps} --horizon {self.horizon}"
            f" --recipes {','.join(self.recipes)}"
            f" --channels {','.join(map(str, self.channels))}"
        )


class UNet(UNetLayers):
    """The network of ``recon.unet``, layer for layer, for training.

    Args:
        channels: feature maps on each level.
        doubt: feature maps of the doubt's own, if there are any.
    """

    def __init__(self, channels: tuple[int, ...], doubt: int = 0) -> None:
        super().__init__(channels, unet.INPUTS, unet.OUTPUTS, doubt=doubt)
        self.doubt = doubt
        with torch.no_grad():
            self.layers["out"].get_parameter("bias")[8:] = FIRST_LOG_DOUBT

    def forward(self, maps: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 3 h w"]:
        """Gradients and doubt; the shapes of ``recon.unet.forward`` with n frames in front."""
        features, coarse = self.all_features(maps)
        weight, bias = (self.layers["out"].get_parameter(name) for name in ("weight", "bias"))
        slopes = functional.conv2d(features, weight[:8], bias[:8])
        # The doubt learns from the features without shaping them: its gradients are far larger.
        doubt = functional.conv2d(features.detach(), weight[8:], bias[8:])
        if self.doubt:
            seen = self.layers["doubt0"](coarse.detach()).relu()
            doubt = doubt + functional.interpolate(self.layers["doubt1"](seen), scale_factor=2.0)
        found = functional.pixel_shuffle(torch.cat([slopes, doubt], dim=1), 2)
        return torch.cat([found[:, :2] + maps[:, :2], found[:, 2:]], dim=1)


def train(
    settings: Settings, executor: Executor | None = None, checkpoint: Path | None = None
) -> tuple[dict[str, np.ndarray], list[float]]:
    """The trained weights and the loss of every step; progress on stdout.

    Args:
        settings: what decides them.
        executor: makes the batches; this process where it is None.
        checkpoint: what is kept on the way, from which it goes on where it is there.

    Raises:
        WedgeError: the checkpoint belongs to another training, or cannot be read or written.
    """
    torch.manual_seed(settings.seed)
    network = UNet(settings.channels).to(DEVICE)
    optimizer = Soap(network.parameters())
    training = ResumableTraining(network, optimizer, settings.steps, asdict(settings), checkpoint)
    make = partial(training_batch, settings)
    ahead = made_ahead(make, training.left, executor, BATCHES_AHEAD) if executor else None
    batches = iter(ahead or map(make, training.left))

    def learn(step: int) -> float:
        maps, truth = (torch.from_numpy(item).to(DEVICE) for item in next(batches))
        found = network(maps)
        loss = slope_loss(found, truth)
        optimizer.zero_grad()
        (loss + DOUBT_SHARE * doubt_losses(found, truth).mean()).backward()
        nn.utils.clip_grad_norm_(network.parameters(), STEEPEST_STEP)
        optimizer.step(learning_rate(step, settings.steps, settings.horizon))
        return loss.item()

    losses = training.follow(learn)
    return network.weights(), losses


def slope_loss(found: Float[Tensor, "n 3 h w"], truth: Float[Tensor, "n 2 h w"]) -> Tensor:
    """Of both slopes, in shares of ``HUBER_SLOPE``'s."""
    return 2 * functional.huber_loss(found[:, :2], truth, delta=HUBER_SLOPE)


def training_batch(settings: Settings, step: int) -> Batch:
    """Network inputs from what random sensors measure of fresh surfaces, and the true gradients."""
    rng = np.random.default_rng([settings.seed, step])
    large = rng.random() < LARGE_SHARE
    frames, size_px = (LARGE_FRAMES, LARGE_PX) if large else (SMALL_FRAMES, SMALL_PX)
    maps, truth = [], []
    for _ in range(frames):
        recipe = settings.recipes[0 if rng.random() < PAPER_SHARE else -1]
        gradient = surface_gradient(RECIPES[recipe](rng, *size_px))
        seen = measure(rng, gradient)
        maps.append(unet.network_input(seen.gradient, seen.support, both=seen.both))
        truth.append(gradient.transpose(2, 0, 1))
    return np.stack(maps), np.stack(truth)


def learning_rate(step: int, steps: int, horizon: int) -> float:
    """Up on a line, down on a cosine (Smith and Topin, 2018), and to zero at the end."""
    first = max(1.0, WARM_UP * horizon)
    fall = min(1.0, (steps - step) / (LAST_FALL * steps))
    if step < first:
        return LEARNING_RATE * fall * (step + 1) / (first + 1)
    cosine = float(np.cos(np.pi * (step - first) / (horizon - first)))
    return LEARNING_RATE * fall * 0.5 * (1 + cosine)


def doubt_losses(
    found: Float[Tensor, "n 3 h w"], truth: Float[Tensor, "n 2 h w"]
) -> Float[Tensor, "n h w"]:
    """Minus the log likelihood of the x slope's error under Laplace's law."""
    error = (found[:, 0] - truth[:, 0]).detach().abs()
    log_doubt = found[:, 2].clamp(-8.0, 3.0)
    return error * torch.exp(-log_doubt) + log_doubt


def share_of_zeros_error(
    weights: unet.Weights, axis: Axis, size_px: tuple[int, int], presses: int = 40
) -> float:
    """Error of the inferred axis over the error of calling it zero, on balls nobody trained on.

    Mean absolute errors over the error table's pixels; the known axis has a noise of 0.04.
    """
    rng = np.random.default_rng(0)
    missing, known = (0, 1) if axis == "x" else (1, 0)
    errors, slopes = [], []
    for _ in range(presses):
        ball = random_ball(rng, size_px)
        truth = ball.gradient
        measured = truth[..., known] + TEST_NOISE * rng.standard_normal(truth.shape[:2])
        found = infer_missing_axis(measured, axis, SQUARE, weights=weights)
        inferred = found.gradient[..., missing]
        chosen = ball.judged(rng)
        errors.append(np.abs(inferred - truth[..., missing])[chosen])
        slopes.append(np.abs(truth[..., missing])[chosen])
    return float(np.concatenate(errors).mean() / np.concatenate(slopes).mean())


def print_measures(weights: unet.Weights) -> None:
    """The numbers that the README beside the weights states."""
    axes: tuple[Axis, ...] = ("x", "y")
    for size_px in [(320, 240), (200, 150), (640, 480)]:
        for axis in axes:
            share = share_of_zeros_error(weights, axis, size_px)
            print(f"{size_px[0]}x{size_px[1]}, axis {axis}: {share:.3f} of zero's error on balls")


def main() -> None:
    """Train, save the weights and print the numbers that their README states."""
    parser = argparse.ArgumentParser(
        prog="python -m recon.training.missing_axis", description=__doc__
    )
    parser.add_argument("--seed", type=at_least(0), default=0)
    parser.add_argument("--steps", type=int, default=4000, help="batches")
    parser.add_argument("--horizon", type=int, help="of the learning rate; --steps unless given")
    parser.add_argument("--channels", default=",".join(map(str, unet.CHANNELS)))
    parser.add_argument(
        "--recipes", type=some_of(RECIPES), default="paper,contact", help=" or ".join(RECIPES)
    )
    parser.add_argument("--workers", type=at_least(0), default=1, help="that make surfaces")
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    options = parser.parse_args()
    try:
        channels = tuple(int(count) for count in options.channels.split(","))
    except ValueError:
        parser.error("--channels must be whole numbers with commas between them")
    recipes = tuple(recipe for recipe in RECIPES if recipe in options.recipes)
    horizon = options.horizon or options.steps
    if not 2 <= options.steps <= horizon or len(channels) < 2 or min(channels) < 1:
        parser.error("--steps and --channels need two at least, --horizon no less than --steps")
    settings = Settings(
        seed=options.seed,
        steps=options.steps,
        horizon=horizon,
        channels=channels,
        recipes=recipes,
    )
    torch.set_num_threads(1)  # faster than two on a busy machine, and the same sums every time
    command = f"python -m recon.training.missing_axis {settings.arguments} --out {options.out.name}"
    checkpoint = checkpoint_of(options.out)
    with ending_in_a_sentence(parser):
        refuse_weights(options.out)
        with batch_makers(options.workers) if options.workers else nullcontext() as executor:
            weights, losses = train(settings, executor, checkpoint)
        save_weights(options.out, weights, command, settings.seed)
        write_curve(options.out, losses)
        checkpoint.unlink(missing_ok=True)
        print_measures(weights)


if __name__ == "__main__":
    main()
