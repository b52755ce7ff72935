# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The raw frame to the gel plane: four corners of the pad, and the lens where it is known.

The corners map to the outer edges of the unwarped frame, so that a pixel's centre is half a
pixel inside; homography as in Hartley and Zisserman, Multiple View Geometry, 2003, section 4.1.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, Float64

from recon.arrays import Frame, Unwarped
from recon.geometry.lens import Lens
from recon.images import GRAY, is_gray
from sensor.errors import WedgeError
from sensor.toml import Pair

Corners = tuple[Pair, Pair, Pair, Pair]
PixelMap = Float32[np.ndarray, "h w"]
EVEN_ONLY = ": video files hold even sizes, so name a folder of the frames"


@dataclass(frozen=True, kw_only=True)
class Unwarp:
    """A prepared map from frames of one camera to the gel plane."""

    frame_size_px: tuple[int, int]
    size_px: tuple[int, int]
    maps: tuple[PixelMap, PixelMap] | None
    """Raw x and y of every unwarped pixel; ``None`` where frames show the gel plane already."""

    def __call__(self, frame: Frame) -> Unwarped:
        """Unwarp a frame, in units of full scale.

        Raises:
            WedgeError: the frame has another size than the camera's.
        """
        self.check(frame)
        full_scale = frame.astype(np.float32) / 255
        if self.maps is None:
            return full_scale
        return cv2.remap(full_scale, *self.maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def check(self, frame: Frame) -> None:
        """Refuse what is no frame of this camera.

        Raises:
            WedgeError: the frame has another size than the camera's, or is no colours in bytes.
        """
        if not isinstance(frame, np.ndarray) or isinstance(frame, np.ma.MaskedArray):
            raise WedgeError(
                f"a frame is an array (height, width, 3) uint8, not {type(frame).__name__}: read "
                "its file with recon.images.read_image."
            )
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3:
            raise WedgeError(
                f"a frame is bytes of red, green and blue, (height, width, 3) uint8, not "
                f"{frame.shape} {frame.dtype}."
            )
        height, width = frame.shape[:2]
        if (width, height) != self.frame_size_px:
            expected = "x".join(map(str, self.frame_size_px))
            even = tuple(side - side % 2 for side in self.frame_size_px)
            mend = EVEN_ONLY if (width, height) == even else ""
            raise WedgeError(f"the frame is {width}x{height} pixels, not {expected}{mend}.")

    def check_colored(self, frame: Frame) -> None:
        """Refuse also what shows no slopes.

        Raises:
            WedgeError: as ``check``, or the frame is grey: its red, green and blue are one.
        """
        self.check(frame)
        if is_gray(frame):
            raise WedgeError(GRAY)


def is_within(place_px: Pair, size_px: tuple[int, int]) -> bool:
    """Whether a place lies in a frame of that size (width, height), its outer edges included."""
    return all(-0.5 <= at <= side - 0.5 for at, side in zip(place_px, size_px, strict=True))


def prepare_unwarp(
    frame_size_px: tuple[int, int],
    corners_px: Corners | None = None,
    size_px: tuple[int, int] | None = None,
    lens: Lens | None = None,
) -> Unwarp:
    """Prepare the map to the gel plane.

    Args:
        frame_size_px: (width, height) of the raw frames.
        corners_px: top left, top right, bottom right, bottom left of the pad, in raw pixels;
            ``None`` where the frames show the gel plane already.
        size_px: (width, height) of the unwarped frames, where there are corners.
        lens: removes the lens's distortion on the way.

    Raises:
        WedgeError: a corner lies outside the frame, there are corners without a size or a size
            without corners, or the lens was measured on other frames.
    """
    if (corners_px is None) != (size_px is None):
        raise WedgeError("corners_px and size_px must be given together.")
    if lens is not None and lens.frame_size_px != frame_size_px:
        raise WedgeError(
            f"the lens was measured on {'x'.join(map(str, lens.frame_size_px))} frames, but these "
            f"are {'x'.join(map(str, frame_size_px))}: calibrate the lens at this resolution."
        )
    if corners_px is None or size_px is None:
        if lens is None:
            return Unwarp(frame_size_px=frame_size_px, size_px=frame_size_px, maps=None)
        size_px, homography = frame_size_px, np.eye(3)
    else:
        homography = _to_ideal(frame_size_px, corners_px, size_px, lens)
    width, height = size_px
    rows, columns = np.indices((height, width), dtype=np.float64)
    pixels = np.stack([columns.ravel(), rows.ravel()], 1)
    raw = cv2.perspectiveTransform(pixels[:, None], homography)[:, 0]
    if lens is not None:
        raw = lens.distort(raw)
    map_x, map_y = raw.T.reshape(2, height, width).astype(np.float32)
    return Unwarp(frame_size_px=frame_size_px, size_px=size_px, maps=(map_x, map_y))


def _to_ideal(
    frame_size_px: tuple[int, int],
    corners_px: Corners,
    size_px: tuple[int, int],
    lens: Lens | None,
) -> Float64[np.ndarray, "3 3"]:
    """Homography from unwarped pixels to pixels that a lens without distortion would see."""
    width, height = frame_size_px
    for corner in corners_px:
        if not is_within(corner, frame_size_px):
            raise WedgeError(
                f"corners_px: ({corner[0]:g}, {corner[1]:g}) lies outside the {width}x{height} "
                f"frame, which ends at -0.5, {width - 0.5:g} and {height - 0.5:g}."
            )
    seen = np.array(corners_px, dtype=np.float64)
    ideal = seen if lens is None else lens.undistort(seen)
    right, bottom = size_px[0] - 0.5, size_px[1] - 0.5
    edges = np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])
    return cv2.getPerspectiveTransform(edges.astype(np.float32), ideal.astype(np.float32))
