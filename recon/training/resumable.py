# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Training step by step, on a GPU where there is one, going on where it was interrupted."""

import json
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from recon.tensor_files import read_tensors
from recon.training.torch_layers import UNetLayers
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.files import write_atomic
from sensor.interrupt import Asked

try:
    import torch

    from recon.estimators.optimizers import Soap
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")

DEVICE = "cuda" if torch.cuda.is_available() else "cpu"
CHECKPOINT_STEPS = 500
SHOWN_STEPS = 100

Optimizer = Soap | torch.optim.Adam


class ResumableTraining:
    """A network on its way, with its optimizer and its losses.

    Args:
        network: to be taught; on ``DEVICE``.
        optimizer: of its parameters, or of some.
        steps: of the whole training.
        settings: what else decides the weights, as JSON has it; a checkpoint of others is refused.
        checkpoint: the file that is kept on the way, from which this goes on where it is there;
            nothing is kept without a name.

    Raises:
        WedgeError: the checkpoint cannot be read, or belongs to a training of other settings or of
            another network.
    """

    def __init__(
        self,
        network: UNetLayers,
        optimizer: Optimizer,
        steps: int,
        settings: Mapping[str, object],
        checkpoint: Path | None = None,
    ) -> None:
        self.network, self.optimizer, self.steps = network, optimizer, steps
        self.settings = json.loads(json.dumps({**settings, "steps": steps}))
        self.checkpoint = checkpoint
        self.losses: list[float] = []
        """Of the steps that were taken."""
        if checkpoint is not None and checkpoint.is_file():
            self._resume(checkpoint)
            print(f"going on from step {len(self.losses)} of {checkpoint}", flush=True)

    @property
    def left(self) -> range:
        """The steps that are still to be taken."""
        return range(len(self.losses), self.steps)

    def follow(self, learn: Callable[[int], float]) -> list[float]:
        """Take the steps that are left, with progress on stdout; the loss of every step.

        Args:
            learn: takes the step of that number and returns its loss.

        Raises:
            WedgeError: the checkpoint cannot be written.
            KeyboardInterrupt: Ctrl-C or SIGTERM ended it, after a step; the checkpoint has it.
        """
        begin, left = time.monotonic(), self.left
        with Asked() as asked:
            for step in left:
                self.losses.append(learn(step))
                done, last = step + 1, step + 1 == self.steps
                if done % SHOWN_STEPS == 0 or last:
                    self._show(done - left.start, time.monotonic() - begin)
                due = done % CHECKPOINT_STEPS == 0 or last or asked.to_end
                if self.checkpoint is not None and due:
                    self._save(self.checkpoint)
                if asked.to_end:
                    raise KeyboardInterrupt(self._how_to_go_on())
        return self.losses

    def _show(self, taken: int, spent_s: float) -> None:
        """Say how far it is, after so many steps since it began or went on."""
        done, mean = len(self.losses), np.mean(self.losses[-SHOWN_STEPS:])
        to_go_s = spent_s / taken * (self.steps - done)
        print(
            f"step {done}/{self.steps}  loss {mean:.5f}  {spent_s:.0f} s, {to_go_s:.0f} s left",
            flush=True,
        )

    def _how_to_go_on(self) -> str:
        """What is said where it was interrupted."""
        if self.checkpoint is None:
            return f"interrupted after step {len(self.losses)}"
        return (
            f"interrupted after step {len(self.losses)}, which {self.checkpoint} keeps: "
            "the same command goes on from there."
        )

    def _save(self, path: Path) -> None:
        """Write the checkpoint, atomically."""
        tensors = {"losses": np.array(self.losses)}
        for name, parameter in self.network.layers.named_parameters():
            tensors[f"weights.{name}"] = parameter.detach().cpu().numpy()
            for key, value in self.optimizer.state[parameter].items():
                tensors[f"{key}.{name}"] = value.cpu().numpy()
        kept = {name: np.ascontiguousarray(values) for name, values in tensors.items()}
        write_atomic(path, save(kept, {"settings": json.dumps(self.settings)}))

    def _resume(self, path: Path) -> None:
        """Take on what a checkpoint keeps."""
        said, tensors = read_tensors(path, " as a checkpoint", "delete it to begin")
        try:
            settings = json.loads(said.get("settings", "{}"))
        except (json.JSONDecodeError, RecursionError) as error:
            raise WedgeError(
                f"{path} cannot be read as a checkpoint: {error}; delete it to begin."
            ) from error
        if settings != self.settings:
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
                key: torch.from_numpy(values).to("cpu" if key == "step" else DEVICE)
                for (key, of), values in kept.items()
                if of == name and key != "weights"
            }


def checkpoint_of(out: Path, course: str = "") -> Path:
    """Where the checkpoint of these weights lies until they are written.

    Args:
        out: the weights to come.
        course: its name, where they are taught in several.
    """
    return out.with_suffix(f".{course or 'checkpoint'}.safetensors")
