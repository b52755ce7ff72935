# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The layers of ``recon.unet`` in torch, for training; needs the extra ``train``."""

import sys

import numpy as np
from jaxtyping import Float

from recon import unet
from sensor.extras import how_to_install

try:
    import torch
    from torch import Tensor, nn
    from torch.nn import functional
except ModuleNotFoundError:  # one sentence in place of a traceback
    sys.exit(f"Training needs torch: {how_to_install('train')}.")


class UNetLayers(nn.Module):
    """All convolutions, and what they make of a picture up to the last one.

    Args:
        channels: feature maps on each level.
        inputs: maps in.
        outputs: maps out.
        fine: feature maps of the layers at full resolution, if there are any.
        doubt: feature maps of the doubt's own, if there are any.
    """

    def __init__(
        self,
        channels: tuple[int, ...],
        inputs: int,
        outputs: int,
        fine: tuple[int, ...] = (),
        doubt: int = 0,
    ) -> None:
        super().__init__()
        self.depth = len(channels)
        self.layers = nn.ModuleDict(
            {
                name: nn.Conv2d(wide_in, wide_out, side, padding="same")
                for name, (wide_out, wide_in, side) in unet.layer_shapes(
                    channels, inputs, outputs, fine, doubt
                ).items()
            }
        )
        # He's scale keeps signals alive through all layers; the zero spares unlearning an offset.
        for name, layer in self.layers.items():
            if name in ("last" if fine else "out", "doubt1"):
                nn.init.zeros_(layer.get_parameter("weight"))
            else:
                nn.init.kaiming_normal_(layer.get_parameter("weight"), nonlinearity="relu")
            nn.init.zeros_(layer.get_parameter("bias"))

    def take(self, weights: unet.Weights) -> None:
        """Go on from these, which need not have what the doubt has of its own."""
        with torch.no_grad():
            for name, parameter in self.layers.named_parameters():
                if name in weights:
                    parameter.copy_(torch.from_numpy(np.array(weights[name])))

    def features(self, maps: Float[Tensor, "n maps h w"]) -> Float[Tensor, "n channels h//2 w//2"]:
        """What the last layer sees."""
        return self.all_features(maps)[0]

    def all_features(
        self, maps: Float[Tensor, "n maps h w"]
    ) -> tuple[Float[Tensor, "n channels h//2 w//2"], Float[Tensor, "n coarse h//4 w//4"]]:
        """What the last layer sees, and what the doubt's own does."""
        layers = self.layers
        features = functional.pixel_unshuffle(maps, 2)
        skips: list[Tensor] = []
        coarse: list[Tensor] = []
        for level in range(self.depth):
            if level > 0:
                features = functional.avg_pool2d(features, 2)
            if level == 1:
                coarse.append(features)
            features = layers[f"down{level}a"](features).relu()
            features = layers[f"down{level}b"](features).relu()
            skips.append(features)
        for level in reversed(range(self.depth - 1)):
            if level == 0:
                coarse.append(features)
            lifted = functional.interpolate(layers[f"lift{level}"](features), scale_factor=2.0)
            features = torch.cat([skips[level], lifted], dim=1)
            features = layers[f"up{level}a"](features).relu()
            features = layers[f"up{level}b"](features).relu()
        return features, torch.cat(coarse, dim=1)

    def weights(self) -> dict[str, np.ndarray]:
        """Copies of all parameters under the names of ``recon.unet``."""
        state = self.layers.state_dict()
        return {name: value.cpu().numpy().copy() for name, value in state.items()}
