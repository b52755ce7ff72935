# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera's lens: measured once from pictures of a chessboard, then undone in every unwarp.

The model is a pinhole with three radial terms (Brown, Close-range camera calibration, 1971;
Zhang, A flexible new technique for camera calibration, 2000). It was chosen on ten boards of a
wide-angle camera module at 640x480, by the reprojection error of each board when it was left
out of the fit: two radial terms 0.58 px, three 0.31 px, three with tangential terms 0.32 px, a
rational model 0.30 px, an equidistant fisheye 0.29 px. Boards differ among themselves by 0.2 to
0.4 px, so the last two gain nothing that shows; the rational one may have poles in the frame,
and the three terms have a Newton inverse that is exact to rounding.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64

from recon.arrays import Frame
from sensor.dataset import LARGEST_SIDE_PX
from sensor.errors import WedgeError
from sensor.files import write_atomic
from sensor.toml import (
    Pair,
    finite,
    located,
    positive,
    positive_pair,
    read_toml,
    refuse_missing_keys,
    refuse_unknown_keys,
    toml_text,
)

Points = Float64[np.ndarray, "n 2"]

KEYS = ("frame_size_px", "focal_px", "center_px", "radial", "rms_px")
FEWEST_BOARDS = 3
NEWTON_STEPS = 60
FOCAL_SIDES = (0.1, 100.0)
"""Focal lengths, in longer sides of the frame: as a pinhole, one sees 157 degrees of the world and
the other, a telescope's, 0.6. The wide-angle camera has 0.37."""
CENTER_SIDES = 2.0
"""The principal point lies no farther outside the frame, in its longer sides: it may be a crop."""
MOST_TERM = 100.0
"""No radial term moves the frame's farthest corner by more times its distance from the centre; the
wide-angle camera's move it by 6 at most."""


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A pinhole camera with radial distortion, as ``camera.toml`` keeps it.

    Raises:
        WedgeError: no lens has such numbers, or the distortion folds the picture over itself inside
            the frame.
    """

    frame_size_px: tuple[int, int]
    """(width, height) of the frames that it was measured on."""
    focal_px: Pair
    center_px: Pair
    """The principal point; pixel centres are integers."""
    radial: tuple[float, float, float]
    """k1, k2, k3: an ideal radius r, in focal lengths, is seen at r (1 + k1 r² + k2 r⁴ + k3 r⁶)."""
    rms_px: float
    """Root mean square distance of the boards' corners from the model."""

    def __post_init__(self) -> None:
        self._refuse_what_no_lens_has()
        width, height = self.frame_size_px
        corners = np.array([(x, y) for x in (-0.5, width - 0.5) for y in (-0.5, height - 0.5)])
        farthest = float(np.linalg.norm((corners - self.center_px) / self.focal_px, axis=1).max())
        for term, power in zip(self.radial, (2, 4, 6), strict=True):
            if not abs(term) * farthest**power <= MOST_TERM:
                raise WedgeError(
                    f"radial = {list(self.radial)} fits no lens: {term:g} would move the frame's "
                    "corner by over a hundred times its distance from the centre; calibrate the "
                    "lens again."
                )
        fold = self._fold()
        if np.isfinite(fold) and self._seen_radius(np.array([fold]))[0] <= farthest:
            raise WedgeError(
                "the lens's distortion folds the picture over itself inside the frame: "
                "take chessboards nearer to the frame's corners and calibrate again."
            )

    def _refuse_what_no_lens_has(self) -> None:
        """Refuse a frame, a focal length or a centre that the rest would overflow with."""
        longer = max(self.frame_size_px)
        least, most = (sides * longer for sides in FOCAL_SIDES)
        around = CENTER_SIDES * longer
        fault = ""
        if not 1 <= min(self.frame_size_px) <= longer <= LARGEST_SIDE_PX:
            fault = f"frame_size_px must be 1 to {LARGEST_SIDE_PX} pixels a side"
        elif not all(least <= focal <= most for focal in self.focal_px):
            fault = f"focal_px must lie between {least:g} and {most:g} for such frames"
        elif not all(-around <= center <= longer + around for center in self.center_px):
            fault = f"center_px must lie between {-around:g} and {longer + around:g}"
        if fault:
            raise WedgeError(f"{fault}: calibrate the lens again.")

    def distort(self, points: Points) -> Points:
        """Ideal pixels, as a lens without distortion would see them, to raw pixels."""
        rays = (points - self.center_px) / self.focal_px
        r = np.linalg.norm(rays, axis=1, keepdims=True)
        k1, k2, k3 = self.radial
        scale = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
        raw: Points = rays * scale * self.focal_px + self.center_px
        return raw

    def undistort(self, points: Points) -> Points:
        """Raw pixels of the frame to ideal pixels: the inverse of ``distort``."""
        rays = (points - self.center_px) / self.focal_px
        seen = np.linalg.norm(rays, axis=1)
        ideal = self._ideal_radius(seen)
        scale = np.divide(ideal, seen, out=np.ones_like(seen), where=seen > 0)
        straight: Points = rays * scale[:, None] * self.focal_px + self.center_px
        return straight

    def _seen_radius(self, r: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
        k1, k2, k3 = self.radial
        seen: Float64[np.ndarray, " n"] = r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6)
        return seen

    def _ideal_radius(self, seen: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
        """Newton's method on the radius, kept inside a bracket that bisection shrinks."""
        k1, k2, k3 = self.radial
        far = self._fold()
        if np.isinf(far):
            far = 1.0
            while self._seen_radius(np.array([far]))[0] < seen.max(initial=0):
                far *= 2
        low, high = np.zeros_like(seen), np.full_like(seen, far)
        r = np.minimum(seen, high)
        for _ in range(NEWTON_STEPS):
            error = self._seen_radius(r) - seen
            if np.abs(error).max(initial=0) < 1e-14:
                break
            low, high = np.where(error < 0, r, low), np.where(error > 0, r, high)
            slope = 1 + 3 * k1 * r**2 + 5 * k2 * r**4 + 7 * k3 * r**6
            step = r - error / np.where(slope == 0, 1, slope)
            inside = (step >= low) & (step <= high)
            r = np.where(inside, step, (low + high) / 2)
        return r

    def _fold(self) -> float:
        """The ideal radius where the seen radius stops growing; infinite where it never does."""
        k1, k2, k3 = self.radial
        # The slope is 1 + 3 k1 r² + 5 k2 r⁴ + 7 k3 r⁶; solved for 1/r², to allow k3 = 0.
        inverse_squares = np.roots([1, 3 * k1, 5 * k2, 7 * k3])
        turning = [u.real for u in inverse_squares if abs(u.imag) < 1e-9 and u.real > 1e-9]
        return float(1 / np.sqrt(max(turning))) if turning else float("inf")


@dataclass(frozen=True, kw_only=True)
class Boards:
    """The chessboards that were found in a camera's pictures."""

    frame_size_px: tuple[int, int]
    pattern: tuple[int, int]
    """Inner corners along and across the board."""
    corners_px: Mapping[str, Points]
    """Of each picture, row by row."""
    left_out: tuple[str, ...]
    """Pictures in which no whole board was found."""


def find_boards(
    images: Mapping[str, Frame],
    progress: Callable[[float], None] = lambda _: None,
) -> Boards:
    """Find a chessboard's inner corners, to a fraction of a pixel, in pictures of one camera.

    Args:
        images: pictures of one camera, by name.
        progress: told the share that is done.

    Raises:
        WedgeError: pictures differ in size, or too few of them show a whole board.
    """
    gray = {name: cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for name, image in images.items()}
    sizes = {image.shape[::-1]: name for name, image in gray.items()}
    if len(sizes) > 1:
        raise WedgeError(
            f"{' and '.join(sizes.values())} differ in size: "
            "calibrate a lens on pictures of one camera at one resolution."
        )
    if not images:
        raise WedgeError("no picture of a chessboard was given: name a folder that holds some.")
    pattern = _commonest_pattern(gray, lambda share: progress(share / 2))
    found: dict[str, Points] = {}
    for number, (name, image) in enumerate(gray.items()):
        if pattern is None:
            break
        progress((1 + number / len(gray)) / 2)
        ok, corners = cv2.findChessboardCornersSB(image, pattern, flags=cv2.CALIB_CB_ACCURACY)
        if ok:
            found[name] = corners[:, 0].astype(np.float64)
    if pattern is None or len(found) < FEWEST_BOARDS:
        raise WedgeError(
            f"a whole chessboard was found in {len(found)} of {len(images)} pictures; "
            f"{FEWEST_BOARDS} are needed, tilted and spread over the frame."
        )
    return Boards(
        frame_size_px=next(iter(sizes)),
        pattern=pattern,
        corners_px=found,
        left_out=tuple(name for name in images if name not in found),
    )


def calibrate_lens(boards: Boards) -> Lens:
    """Fit the lens to the corners of several boards.

    Raises:
        WedgeError: the boards do not determine a lens that is one-to-one over the frame.
    """
    board = _board(boards.pattern)
    width, height = boards.frame_size_px
    # Without a first guess, boards that face the camera send the focal length to infinity.
    guess = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1.0]])
    try:
        rms_px, camera, terms, _, _ = cv2.calibrateCamera(
            [board] * len(boards.corners_px),
            [corners.astype(np.float32) for corners in boards.corners_px.values()],
            boards.frame_size_px,
            guess,
            np.zeros(5),
            flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_ZERO_TANGENT_DIST,
            criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-9),
        )
    except cv2.error as error:
        raise WedgeError("the chessboards do not determine a lens: tilt them more.") from error
    k1, k2, _, _, k3 = (float(term) for term in terms.ravel())
    return Lens(
        frame_size_px=boards.frame_size_px,
        focal_px=(float(camera[0, 0]), float(camera[1, 1])),
        center_px=(float(camera[0, 2]), float(camera[1, 2])),
        radial=(k1, k2, k3),
        rms_px=float(rms_px),
    )


def board_misses_px(boards: Boards, lens: Lens) -> dict[str, Points]:
    """From where the lens would show each corner of a flat board to where it was seen.

    Each board lies where it fits its corners best, in ideal pixels.
    """
    grid = _board(boards.pattern)[:, :2]
    misses = {}
    for name, corners in boards.corners_px.items():
        to_ideal, _ = cv2.findHomography(grid, lens.undistort(corners))
        flat = cv2.perspectiveTransform(grid[:, None].astype(np.float64), to_ideal)[:, 0]
        misses[name] = corners - lens.distort(flat)
    return misses


def seen_share(boards: Boards, lens: Lens) -> float:
    """How far out the boards show the lens, as a share of the frame's farthest corner.

    Beyond, the lens is extrapolated.
    """
    width, height = boards.frame_size_px
    ends = np.array([(x, y) for x in (-0.5, width - 0.5) for y in (-0.5, height - 0.5)])
    seen = np.concatenate(list(boards.corners_px.values()))
    farthest = [np.linalg.norm(points - lens.center_px, axis=1).max() for points in (seen, ends)]
    return float(farthest[0] / farthest[1])


def read_lens(path: Path) -> Lens:
    """Read a ``camera.toml``.

    Raises:
        WedgeError: names the file and the key, and what is wrong with it.
    """
    document = read_toml(path)
    try:
        refuse_unknown_keys(document, list(KEYS), "")
        refuse_missing_keys(document, KEYS)
        width, height = positive_pair(document["frame_size_px"], "frame_size_px")
        center, radial = document["center_px"], document["radial"]
        if not isinstance(center, list) or len(center) != 2:
            raise WedgeError(f"center_px must be a pair [x, y], not {center!r}.")
        if not isinstance(radial, list) or len(radial) != 3:
            raise WedgeError(f"radial must be three numbers [k1, k2, k3], not {radial!r}.")
        k1, k2, k3 = (finite(term, "radial") for term in radial)
        return Lens(
            frame_size_px=(round(width), round(height)),
            focal_px=positive_pair(document["focal_px"], "focal_px"),
            center_px=(finite(center[0], "center_px"), finite(center[1], "center_px")),
            radial=(k1, k2, k3),
            rms_px=positive(document["rms_px"], "rms_px"),
        )
    except WedgeError as error:
        raise located(path, error) from error


def write_lens(path: Path, lens: Lens) -> None:
    """Write a ``camera.toml`` atomically."""
    write_atomic(path, toml_text({key: getattr(lens, key) for key in KEYS}).encode())


def _board(pattern: tuple[int, int]) -> np.ndarray:
    """A flat board's inner corners, row by row, one square apart; float32 ``(n, 3)``."""
    columns, rows = pattern
    across, along = np.mgrid[:rows, :columns]
    return np.stack([along, across, np.zeros_like(along)], -1).reshape(-1, 3).astype(np.float32)


def _commonest_pattern(
    gray: Mapping[str, np.ndarray], progress: Callable[[float], None]
) -> tuple[int, int] | None:
    """The size of the board that is seen whole in most pictures."""
    seen: Counter[tuple[int, int]] = Counter()
    for number, image in enumerate(gray.values()):
        progress(number / len(gray))
        ok, _, meta = cv2.findChessboardCornersSBWithMeta(image, (3, 3), cv2.CALIB_CB_LARGER)
        if ok:
            rows, columns = sorted(meta.shape[:2])
            seen[columns, rows] += 1
    return max(seen, key=lambda size: (seen[size], size[0] * size[1]), default=None)
