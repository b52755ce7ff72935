# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the U-Net of the missing gradient axis on random surfaces; the paper's, on one CPU core.

``python -m recon.unet_training --seed 0 --out FILE`` made the shipped weights. Every batch is drawn
anew from the seed, so that no surface is seen twice and none needs storing. Needs the extra
``train``.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from recon import unet
from recon.ball import ball_cap, offsets_mm
from recon.missing_axis import Axis, infer_missing_axis, save_weights
from recon.surfaces import random_surface, surface_gradient
from sensor.errors import WedgeError

SMALL_PX, SMALL_FRAMES = (96, 128), 8
LARGE_PX, LARGE_FRAMES = (224, 320), 4  # a frame in use, so that large contacts are learnt as well
LARGE_SHARE = 0.25  # of the batches
SLOPE_NOISE = (0.03, 0.05)  # standard deviations, of a calibrated sensor's measured axis
TEST_NOISE = 0.04
LEARNING_RATE = 3e-3
HUBER_SLOPE = 0.1  # errors below it count squared, above it linearly: a rim is no outlier

AXES: tuple[Axis, ...] = ("x", "y")


class UNet(nn.Module):
    """The network of ``recon.unet``, layer for layer, for training."""

    def __init__(self) -> None:
        super().__init__()
        self.layers = nn.ModuleDict(
            {
                name: nn.Conv2d(wide_in, wide_out, side, padding="same")
                for name, (wide_out, wide_in, side) in unet.layer_shapes().items()
            }
        )
        # He's scale keeps signals alive through all layers; the zero spares unlearning an offset.
        for name, layer in self.layers.items():
            if name == "out":
                nn.init.zeros_(layer.get_parameter("weight"))
            else:
                nn.init.kaiming_normal_(layer.get_parameter("weight"), nonlinearity="relu")
            nn.init.zeros_(layer.get_parameter("bias"))

    def forward(self, maps: Float[Tensor, "n 2 h w"]) -> Float[Tensor, "n 1 h w"]:
        """The missing x gradient; the shapes of ``recon.unet.forward`` with n frames in front."""
        layers = self.layers
        last = len(unet.CHANNELS) - 1
        features = maps
        skips: list[Tensor] = []
        for level in range(last + 1):
            if level > 0:
                features = functional.avg_pool2d(features, 2)
            features = layers[f"down{level}a"](features).relu()
            features = layers[f"down{level}b"](features).relu()
            skips.append(features)
        for level in reversed(range(last)):
            lifted = functional.interpolate(layers[f"lift{level}"](features), scale_factor=2.0)
            features = torch.cat([skips[level], lifted], dim=1)
            features = layers[f"up{level}a"](features).relu()
            features = layers[f"up{level}b"](features).relu()
        result: Tensor = layers["out"](features)
        return result

    def weights(self) -> dict[str, np.ndarray]:
        """Copies of all parameters under the names of ``recon.unet``."""
        return {name: value.numpy().copy() for name, value in self.layers.state_dict().items()}


def training_batch(
    rng: np.random.Generator, frames: int, size_px: tuple[int, int]
) -> tuple[Float[Tensor, "n 2 h w"], Float[Tensor, "n 1 h w"]]:
    """Network inputs from noisy y gradients, and the true x gradients, of fresh surfaces."""
    gradients = np.stack([surface_gradient(random_surface(rng, *size_px)) for _ in range(frames)])
    noise = rng.standard_normal(gradients.shape[:3], np.float32)
    noise *= rng.uniform(*SLOPE_NOISE, (frames, 1, 1)).astype(np.float32)
    missing, known = gradients[..., 0], gradients[..., 1] + noise
    maps = np.stack([unet.network_input(frame) for frame in known])
    return torch.from_numpy(maps), torch.from_numpy(missing)[:, None].contiguous()


def train(
    seed: int, steps: int, report: Callable[[int, float], None] = lambda step, loss: None
) -> UNet:
    """A network trained for ``steps`` batches; the same seed and steps give the same network.

    Args:
        seed: of the first weights and of every surface and noise.
        steps: batches; the learning rate falls to zero over them.
        report: called after each batch with its number, from 1, and its loss.
    """
    torch.manual_seed(seed)
    network = UNet()
    optimizer = torch.optim.Adam(network.parameters())
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, LEARNING_RATE, total_steps=steps)
    for step in range(steps):
        rng = np.random.default_rng([seed, step])
        large = rng.random() < LARGE_SHARE
        frames, size_px = (LARGE_FRAMES, LARGE_PX) if large else (SMALL_FRAMES, SMALL_PX)
        maps, missing = training_batch(rng, frames, size_px)
        loss = functional.huber_loss(network(maps), missing, delta=HUBER_SLOPE)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        report(step + 1, loss.item())
    return network


def share_of_zeros_error(
    weights: unet.Weights, axis: Axis, size_px: tuple[int, int], presses: int = 40, seed: int = 0
) -> float:
    """Error of the inferred axis over the error of calling it zero, on balls nobody trained on.

    Mean absolute errors over the error table's pixels: inside the contact by a pixel and within 0.9
    of the ball's radius, and 5 % of those beyond 1.3 contact radii. Contacts have 0.1 to 0.4 of the
    frame's shorter side, balls 1.1 to 3.3 contact radii, the known axis a noise of 0.04.
    """
    rng = np.random.default_rng(seed)
    missing, known = (0, 1) if axis == "x" else (1, 0)
    errors, slopes = [], []
    for _ in range(presses):
        contact_px = rng.uniform(0.1, 0.4) * min(size_px)
        ball_px = contact_px / rng.uniform(0.3, 0.9)
        x_px, y_px = (rng.uniform(1.05 * contact_px, s - 1.05 * contact_px) for s in size_px)
        truth = ball_cap(size_px, (x_px, y_px), contact_px, ball_px, (1.0, 1.0)).gradient
        measured = truth[..., known] + TEST_NOISE * rng.standard_normal(truth.shape[:2])
        inferred = infer_missing_axis(measured, axis, (1.0, 1.0), weights)
        distance = np.hypot(*offsets_mm(size_px, (x_px, y_px), (1.0, 1.0)))
        chosen = distance < min(contact_px - 1, 0.9 * ball_px)
        chosen |= (distance > 1.3 * contact_px) & (rng.random(distance.shape) < 0.05)
        errors.append(np.abs(inferred - truth[..., missing])[chosen])
        slopes.append(np.abs(truth[..., missing])[chosen])
    return float(np.concatenate(errors).mean() / np.concatenate(slopes).mean())


def print_measures(weights: unet.Weights) -> None:
    """The numbers that the README beside the weights states."""
    for size_px in [(320, 240), (200, 150), (640, 480)]:
        for axis in AXES:
            share = share_of_zeros_error(weights, axis, size_px)
            print(f"{size_px[0]}x{size_px[1]}, axis {axis}: {share:.3f} of zero's error on balls")
    noise = TEST_NOISE * np.random.default_rng(0).standard_normal((240, 320))
    blank = np.abs(infer_missing_axis(noise, "x", (1.0, 1.0), weights)).mean()
    empty = np.abs(infer_missing_axis(0 * noise, "x", (1.0, 1.0), weights)).mean()
    print(f"320x240, untouched gel: mean |G| {blank:.4f} with noise, {empty:.4f} without")


def main() -> None:
    """Train, save the weights and print the numbers that their README states."""
    parser = argparse.ArgumentParser(prog="python -m recon.unet_training", description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=3000, help="batches")
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    options = parser.parse_args()
    if options.steps < 2:
        parser.error("--steps must be at least 2")
    torch.set_num_threads(1)  # faster than two on a busy machine, and the same sums every time
    command = (
        f"python -m recon.unet_training --seed {options.seed} --steps {options.steps}"
        f" --out {options.out.name}"
    )
    begin = time.monotonic()
    losses: list[float] = []

    def report(step: int, loss: float) -> None:
        losses.append(loss)
        if step % 100 == 0:
            mean, spent = np.mean(losses[-100:]), time.monotonic() - begin
            print(f"step {step}/{options.steps}  loss {mean:.5f}  {spent:.0f} s", flush=True)

    network = train(options.seed, options.steps, report)
    try:
        save_weights(options.out, network.weights(), command, options.seed)
    except WedgeError as error:
        parser.error(str(error))
    print_measures(network.weights())


if __name__ == "__main__":
    main()
