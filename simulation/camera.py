# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""From radiance to the frame that a camera hands over: gains, noise, gamma, eight bits, JPEG.

Each step is a pure function; noise comes from a generator that the caller seeds.
"""

import io
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float, Float32, UInt8
from PIL import Image

Linear = Float[np.ndarray, "h w 3"]
Frame = UInt8[np.ndarray, "h w 3"]

MIDDLE_GRAY: Final = 0.18
"""Share of full scale, linear, at which the untouched gel is exposed on average."""


@dataclass(frozen=True, kw_only=True)
class CameraModel:
    """How a camera renders radiance, once its gains are fixed."""

    gains: tuple[float, float, float]
    """Exposure and white balance together: full scale per unit of radiance."""
    gamma: float = 2.2
    electrons: float = 20_000.0
    """At full scale, of one pixel: four by four photosites of 1300 usable electrons each."""
    read_electrons: float = 20.0
    jpeg_quality: int = 92


def expose(blank: Linear) -> CameraModel:
    """Fix exposure and white balance on the untouched gel, as one does before calibrating.

    Each channel's mean becomes middle gray, the photographer's 18 % of full scale: a skin that
    faces a light gets two to three times as bright before it clips.
    """
    red, green, blue = (MIDDLE_GRAY / float(mean) for mean in blank.mean((0, 1)))
    return CameraModel(gains=(red, green, blue))


def amplified(radiance: Linear, camera: CameraModel) -> Linear:
    """Linear signal, full scale 1."""
    return radiance * np.asarray(camera.gains, radiance.dtype)


def noisy(signal: Linear, camera: CameraModel, rng: np.random.Generator) -> Linear:
    """The signal with shot noise and read noise (both as normal noise), clipped to full scale."""
    deviation = np.sqrt(np.maximum(signal, 0) * camera.electrons + camera.read_electrons**2)
    grain = rng.standard_normal(signal.shape, np.float32) * deviation / camera.electrons
    return np.clip(signal + grain, 0, 1)


def developed(signal: Linear, camera: CameraModel) -> Frame:
    """Eight bits after the gamma curve."""
    return np.round(255 * np.clip(signal, 0, 1) ** (1 / camera.gamma)).astype(np.uint8)


def jpeg(frame: Frame, camera: CameraModel) -> bytes:
    """The frame as a JPEG file.

    Colour is kept at full resolution: a frame of the gel plane has half the pixels across of the
    camera's own, whose JPEG halves the colour's. A raw frame has all of them and keeps colour
    finer than the camera does.
    """
    stream = io.BytesIO()
    Image.fromarray(frame).save(stream, "JPEG", quality=camera.jpeg_quality, subsampling=0)
    return stream.getvalue()


def photograph(radiance: Float32[np.ndarray, "h w 3"], camera: CameraModel, seed: int) -> bytes:
    """The JPEG file of one frame."""
    rng = np.random.default_rng(seed)
    return jpeg(developed(noisy(amplified(radiance, camera), camera, rng), camera), camera)
