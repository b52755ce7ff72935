# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Train the U-Net of the missing gradient axis on random surfaces alone.

``python -m recon.training.missing_axis --out FILE`` made the weights from which
``recon.training.missing_axis_further`` went on to those that ship. Every batch is drawn anew from
the seed, so that no surface is seen twice and none needs storing. Beside FILE it keeps a
checkpoint, from which an interrupted training goes on, and the loss as FILE.csv and FILE.png. It
runs on a GPU where there is one, else on one core. Needs torch, the extra ``train``.
"""

import argparse
import csv
import io
import json
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float32
from safetensors.numpy import save

from recon import unet
from recon.lights import Axis
from recon.missing_axis.inference import infer_missing_axis
from recon.tensors import read_tensors
from recon.training.arguments import at_least, some_of
from recon.training.contact_surfaces import surface_gradient
from recon.training.few_lights import measure
from recon.training.random_balls import SQUARE, random_ball
from recon.training.random_surfaces import RECIPES, Recipe
from recon.training.torch_layers import UNetLayers, made_ahead
from recon.unet.weights import save_weights
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.files import check_outputs, write_atomic

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
CHECKPOINT_STEPS = 500
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

    def take(self, weights: unet.Weights) -> None:
        """Go on from these, which need not have what the doubt has of its own."""
        with torch.no_grad():
            for name, parameter in self.layers.named_parameters():
                if name in weights:
                    parameter.copy_(torch.from_numpy(np.array(weights[name])))

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


class Training:
    """A network on its way: its optimizer and the losses so far, to be saved and gone on from."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.device = "cuda" if torch.cuda.is_available() else "cpu"
        torch.manual_seed(settings.seed)
        self.network = UNet(settings.channels).to(self.device)
        self.optimizer = Soap(self.network.parameters())
        self.losses: list[float] = []

    def run(
        self, executor: Executor | None = None, report: Callable[[int], None] = lambda step: None
    ) -> None:
        """Train to the last step; ``executor`` makes the batches, this process where it is None."""
        settings = self.settings
        steps = range(len(self.losses), settings.steps)
        make = partial(training_batch, settings)
        batches = made_ahead(make, steps, executor, BATCHES_AHEAD) if executor else map(make, steps)
        for step, (maps, truth) in zip(steps, batches, strict=True):
            found = self.network(torch.from_numpy(maps).to(self.device))
            true = torch.from_numpy(truth).to(self.device)
            loss = 2 * functional.huber_loss(found[:, :2], true, delta=HUBER_SLOPE)
            self.optimizer.zero_grad()
            (loss + DOUBT_SHARE * doubt_losses(found, true).mean()).backward()
            nn.utils.clip_grad_norm_(self.network.parameters(), STEEPEST_STEP)
            self.optimizer.step(learning_rate(step, settings.steps, settings.horizon))
            self.losses.append(loss.item())
            report(step + 1)

    def save(self, path: Path) -> None:
        """Write the checkpoint, atomically."""
        tensors = {"losses": np.array(self.losses)}
        for name, parameter in self.network.layers.named_parameters():
            tensors[f"weights.{name}"] = parameter.detach().cpu().numpy()
            for key, value in self.optimizer.state[parameter].items():
                tensors[f"{key}.{name}"] = value.cpu().numpy()
        write_atomic(path, save(tensors, {"settings": json.dumps(asdict(self.settings))}))

    def resume(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            WedgeError: it cannot be read, or belongs to a training of other settings or of another
                network.
        """
        said, tensors = read_tensors(path, " as a checkpoint", "delete it to begin")
        try:
            settings = json.loads(said.get("settings", "{}"))
        except (json.JSONDecodeError, RecursionError) as error:
            raise WedgeError(f"{path} cannot be read as a checkpoint: {error}.") from error
        if settings != json.loads(json.dumps(asdict(self.settings))):
            raise WedgeError(f"{path} is of a training with other settings: delete it to begin.")
        parameters = dict(self.network.layers.named_parameters())
        shapes = {f"weights.{name}": tuple(values.shape) for name, values in parameters.items()}
        found = {name: values.shape for name, values in tensors.items() if name in shapes}
        if "losses" not in tensors or found != shapes:
            raise WedgeError(f"{path} is of another network: delete it to begin.")
        self.losses = tensors["losses"].tolist()
        kept = {key.partition(".")[::2]: values for key, values in tensors.items()}
        for name, parameter in parameters.items():
            parameter.data.copy_(torch.from_numpy(tensors[f"weights.{name}"]))
            self.optimizer.state[parameter] = {
                key: torch.from_numpy(values).to(self.device)
                for (key, of), values in kept.items()
                if of == name and key != "weights"
            }


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
    weights: unet.Weights, axis: Axis, size_px: tuple[int, int], presses: int = 40, seed: int = 0
) -> float:
    """Error of the inferred axis over the error of calling it zero, on balls nobody trained on.

    Mean absolute errors over the error table's pixels; the known axis has a noise of 0.04.
    """
    rng = np.random.default_rng(seed)
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


def refuse_weights(path: Path) -> None:
    """Refuse weights that could not be written, or whose loss could not be, before the hours.

    Raises:
        WedgeError: names the file that is in the way.
    """
    check_outputs(path, *_curve_files(path))


def _curve_files(path: Path) -> tuple[Path, Path]:
    return path.with_suffix(".csv"), path.with_suffix(".png")


def write_curve(path: Path, losses: list[float]) -> None:
    """The loss of every step as ``path``.csv, and its running mean as ``path``.png.

    Raises:
        WedgeError: they cannot be written.
    """
    table, figure = _curve_files(path)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [("step", "loss"), *((step, f"{loss:.6f}") for step, loss in enumerate(losses, start=1))]
    )
    write_atomic(table, text.getvalue().encode())
    width = max(1, len(losses) // 50)
    mean = np.convolve(losses, np.full(width, 1 / width), mode="valid")
    left, top, right, bottom = 90, 40, 780, 400
    along = np.linspace(left, right, len(mean))
    down = bottom - (bottom - top) * mean / mean.max()
    canvas = np.full((450, 800, 3), 255, np.uint8)
    ink, blue = (36, 31, 27), (178, 114, 0)
    cv2.rectangle(canvas, (left, top), (right, bottom), ink)
    cv2.polylines(canvas, [np.stack([along, down], -1).astype(np.int32)], False, blue, 2)
    for words, place in [
        (f"{path.stem}: loss, mean of {width} steps", (left, top - 14)),
        (f"{mean.max():.4f}", (10, top + 12)),
        ("0", (60, bottom)),
        (f"step {width}", (left, bottom + 28)),
        (f"step {len(losses)}", (right - 120, bottom + 28)),
    ]:
        cv2.putText(canvas, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, ink, 1, cv2.LINE_AA)
    write_atomic(figure, cv2.imencode(".png", canvas)[1].tobytes())


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
    try:
        refuse_weights(options.out)
        run(settings, options.out, options.workers)
    except WedgeError as error:
        parser.error(str(error))


def run(settings: Settings, out: Path, workers: int) -> None:
    """Train with progress on stdout and a checkpoint beside the weights."""
    training, checkpoint = Training(settings), out.with_suffix(".checkpoint.safetensors")
    if checkpoint.is_file():
        training.resume(checkpoint)
        print(f"going on from step {len(training.losses)} of {checkpoint}")
    begin, first = time.monotonic(), len(training.losses)

    def report(step: int) -> None:
        if step % 100 == 0 or step == settings.steps:
            mean, spent = np.mean(training.losses[-100:]), time.monotonic() - begin
            left = spent / (step - first) * (settings.steps - step)
            print(
                f"step {step}/{settings.steps}  loss {mean:.5f}  {spent:.0f} s, {left:.0f} s left",
                flush=True,
            )
        if step % CHECKPOINT_STEPS == 0:
            training.save(checkpoint)
            write_curve(out, training.losses)

    if workers > 0:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as executor:
            training.run(executor, report)
    else:
        training.run(None, report)
    weights = training.network.weights()
    command = f"python -m recon.training.missing_axis {settings.arguments} --out {out.name}"
    save_weights(out, weights, command, settings.seed)
    write_curve(out, training.losses)
    checkpoint.unlink(missing_ok=True)
    print_measures(weights)


if __name__ == "__main__":
    main()
