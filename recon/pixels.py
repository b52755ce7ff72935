# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ball presses to labelled pixels: the pixels that calibration learns from and tables judge by.

Contact pixels lie inside ``contact_radius_px - 1`` and inside 0.9 of the ball's radius; their
gradient is the ball cap's. The others lie farther than 1.3 contact radii from the centre, and
their gradient is zero; 5 % of them are drawn with a seed. (The error table's definition.)
"""

import hashlib
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32

from recon.arrays import ContactMask, Difference, Unwarped
from recon.ball import DistanceMap, offsets_mm
from sensor.toml import Pair

RIM_PX = 1.0
STEEPEST = 0.9
"""Of the ball's radius, so that slopes stay below 0.9 / sqrt(1 - 0.81) = 2.07."""
DEEPEST = 0.7
"""Of the ball's radius: circles of wider contacts stay as labelled, as no half-space's collar fits
gel that is pressed in so deep."""
CLEAR_OF_COLLAR = 1.3
SHARE_OF_OTHERS = 0.05


@dataclass(frozen=True, kw_only=True)
class BallPress:
    """One press of the calibration ball, unwarped and labelled."""

    file: str
    difference: Difference
    center_px: Pair
    contact_radius_px: float
    """In pixels of sqrt(x * y) of ``mm_per_px``, as labels count it."""
    ball_radius_mm: float
    mm_per_px: Pair
    hidden: ContactMask | None = None
    """Where dots hid the colour and it was filled in from around them; ``None`` on clear gel."""
    blank: Unwarped | None = None
    """The blank gel, where it is known."""
    light: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """How many times as bright as on the blank gel each colour was; the difference is without."""
    fingerprint: str = ""
    """Of the raw frame, by which it is known again whatever its file is called."""

    @property
    def truth_fingerprint(self) -> str:
        """Of what is taught about the frame: the circle, the ball and the scale."""
        told = (*self.center_px, self.contact_radius_px, self.ball_radius_mm, *self.mm_per_px)
        return hashlib.sha256(repr([float(value) for value in told]).encode()).hexdigest()[:16]

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height)."""
        height, width = self.difference.shape[:2]
        return width, height

    @property
    def shorter_side_mm(self) -> float:
        """The frame's, which lengths are shares of."""
        return min(np.multiply(self.size_px, self.mm_per_px))

    @property
    def contact_radius_mm(self) -> float:
        """Radius of the contact circle."""
        return self.contact_radius_px * float(np.sqrt(np.prod(self.mm_per_px)))

    @property
    def offsets_mm(self) -> tuple[DistanceMap, DistanceMap]:
        """X and y of every pixel from the ball's centre."""
        return offsets_mm(self.size_px, self.center_px, self.mm_per_px)

    @property
    def distance_mm(self) -> DistanceMap:
        """Of every pixel from the ball's centre."""
        return np.hypot(*self.offsets_mm)


@dataclass(frozen=True, kw_only=True)
class Pixels:
    """Labelled pixels of one or more presses."""

    color: Float32[np.ndarray, "n k"]
    """Difference to the background, RGB; a lesson may have more columns."""
    position: Float32[np.ndarray, "n 2"]
    """Along x and y, -1 to 1 across the frame."""
    gradient: Float32[np.ndarray, "n 2"]
    contact: Bool[np.ndarray, " n"]
    press: Int32[np.ndarray, " n"]
    """Index of the press that each pixel comes from."""
    place: Int32[np.ndarray, " n"]
    """Where in that press's frame, counted along the rows."""
    hidden: Bool[np.ndarray, " n"]
    """Under a dot: judged by, but not learnt from."""
    blank: Float32[np.ndarray, "n 3"]
    """Colour of the blank gel there, RGB; grey where it is not known."""
    collar: Float32[np.ndarray, " n"]
    """How far the gel beside its contact follows, in shares of the frame's shorter side; NaN where
    that was not fitted."""
    cap: Float32[np.ndarray, " n"]
    """How deep its ball goes below the rim of the contact, in the same shares."""

    def __len__(self) -> int:
        """Number of pixels."""
        return len(self.color)

    def __getitem__(self, chosen: np.ndarray) -> "Pixels":
        """The chosen pixels."""
        return Pixels(**{item.name: getattr(self, item.name)[chosen] for item in fields(self)})


def positions(size_px: tuple[int, int]) -> Float32[np.ndarray, "h w 2"]:
    """Position of every pixel centre, -1 to 1 from edge to edge along x and y."""
    along = [(2 * np.arange(n, dtype=np.float32) + 1) / n - 1 for n in size_px]
    return np.stack(np.meshgrid(*along), -1)


def label_pixels(press: BallPress, index: int, seed: int) -> Pixels:
    """The labelled pixels of one press; ``index`` and ``seed`` draw the others."""
    x_mm, y_mm = press.offsets_mm
    distance_mm = np.hypot(x_mm, y_mm)
    pitch_mm = press.contact_radius_mm / press.contact_radius_px
    ball_mm = press.ball_radius_mm
    contact = distance_mm < min(press.contact_radius_mm - RIM_PX * pitch_mm, STEEPEST * ball_mm)
    others = np.flatnonzero(distance_mm > CLEAR_OF_COLLAR * press.contact_radius_mm)
    count = round(SHARE_OF_OTHERS * len(others))
    drawn = np.random.default_rng([seed, index]).choice(others, count, replace=False)
    taken = np.concatenate([np.flatnonzero(contact), np.sort(drawn)])
    is_contact = contact.ravel()[taken]
    cap_mm = cap_height_mm(press.contact_radius_mm, ball_mm)
    slope = ball_slopes(x_mm.ravel()[taken], y_mm.ravel()[taken], ball_mm)
    return Pixels(
        color=press.difference.reshape(-1, 3)[taken],
        position=positions(press.size_px).reshape(-1, 2)[taken],
        gradient=np.where(is_contact[:, None], slope, 0).astype(np.float32),
        contact=is_contact,
        press=np.full(len(taken), index, np.int32),
        place=taken.astype(np.int32),
        hidden=np.zeros(len(taken), bool) if press.hidden is None else press.hidden.ravel()[taken],
        blank=blank_at(press, taken),
        collar=np.full(len(taken), np.nan, np.float32),
        cap=np.full(len(taken), cap_mm / press.shorter_side_mm, np.float32),
    )


def ball_slopes(
    x_mm: Float[np.ndarray, " n"], y_mm: Float[np.ndarray, " n"], ball_radius_mm: float
) -> Float[np.ndarray, "n 2"]:
    """Gradient (mm/mm) of a ball's dent at some places, told from the dent's centre.

    Past the ball's edge it goes on as if a tenth of the radius were left of its height.
    """
    squared = ball_radius_mm**2 - np.hypot(x_mm, y_mm) ** 2
    height_mm = np.sqrt(np.maximum(squared, ball_radius_mm**2 / 100))
    return -np.stack([x_mm, y_mm], 1) / height_mm[:, None]


def cap_height_mm(contact_radius_mm: float, ball_radius_mm: float) -> float:
    """How deep a ball goes below the rim of its contact.

    Past the ball's edge, as ``ball_slopes`` does, it is taken to leave a tenth of its radius.
    """
    rim_mm = np.sqrt(max(ball_radius_mm**2 - contact_radius_mm**2, ball_radius_mm**2 / 100))
    return float(ball_radius_mm - rim_mm)


def blank_at(press: BallPress, places: Int[np.ndarray, " n"]) -> Float32[np.ndarray, "n 3"]:
    """Colour of the blank gel at some places, counted along the rows."""
    if press.blank is None:
        return np.full((len(places), 3), 0.5, np.float32)
    return press.blank.reshape(-1, 3)[places]


def join(parts: list[Pixels]) -> Pixels:
    """All pixels of several presses."""
    return Pixels(
        **{
            item.name: np.concatenate([getattr(part, item.name) for part in parts])
            for item in fields(Pixels)
        }
    )
