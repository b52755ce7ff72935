# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How large a pad is taken to be that nothing has measured, and whether it is the design's."""

from typing import TYPE_CHECKING

from sensor.design import STANDARD, Wedge
from sensor.errors import WedgeError
from sensor.toml import Pair

if TYPE_CHECKING:
    from recon.lights import Axis

OTHER_PAD = 0.2
"""Share by which a pad that was measured may differ from its design's; real Wedges do by 0.09."""
NOTED = 0.1
"""From this share on it is said. In the middle of a rendered pad a caliper reads 0.06 less, as
four corners do not undo refraction (``benchmarks.caliper``)."""
SIDES_MM = (1.0, 1000.0)
"""A pad's side is at least the first, and below the second."""


def assumed_pad_mm(design: Wedge | None, pad_size_mm: Pair | None = None) -> Pair:
    """The pad along x and y: as given, else the design's, else the standard's.

    Raises:
        WedgeError: both are given, or a length that no pad has.
    """
    if design is not None and pad_size_mm is not None:
        raise WedgeError(
            "--design and --pad-size-mm both give the size of the pad: use one of them."
        )
    least, most = SIDES_MM
    if pad_size_mm is not None and not all(least <= side < most for side in pad_size_mm):
        raise WedgeError(
            f"--pad-size-mm must be two lengths of at least {least:g} and below {most:g} mm."
        )
    return pad_size_mm or (design or STANDARD).pad_size_mm


def refuse_other_pad(
    pad_size_mm: Pair | None,
    design: Wedge | None,
    where: str,
    remedy: str = "correct pad_size_mm, move labels.csv aside and run `wedge label`",
) -> None:
    """Refuse a design that has another pad than a card states, where both are known.

    Raises:
        WedgeError: names ``where``, both sizes, and what to do where the design is right.
    """
    if design is not None and pad_size_mm is not None and _off(pad_size_mm, design) >= OTHER_PAD:
        raise WedgeError(
            f"{where} has a pad of {_sizes(pad_size_mm, design)}: name the sensor's own design, or "
            f"{remedy}."
        )


def refuse_smaller_pad(
    size_px: tuple[int, int], mm_per_px: Pair, design: Wedge, where: str
) -> None:
    """Refuse a design whose pad is smaller than frames of the gel plane show.

    Raises:
        WedgeError: names ``where``, both sizes, and what to do.
    """
    shown_mm = size_px[0] * mm_per_px[0], size_px[1] * mm_per_px[1]
    if max(s / pad for s, pad in zip(shown_mm, design.pad_size_mm, strict=True)) >= 1 + OTHER_PAD:
        raise WedgeError(
            f"The frames of {where} show gel of {_sizes(shown_mm, design)}: name the sensor's own "
            "design, or correct mm_per_px."
        )


def pad_remark(pad_size_mm: Pair | None, design: Wedge | None) -> str:
    """What to say of a pad that is not quite its design's; empty where there is nothing to say."""
    if design is None or pad_size_mm is None or _off(pad_size_mm, design) < NOTED:
        return ""
    return f"The sensor has a pad of {_sizes(pad_size_mm, design)}: check that the design is right."


def proportion_remark(unseen: "Axis | None") -> str:
    """What to say of a scale that a caliper measured along one axis alone; empty otherwise."""
    if unseen is None:
        return ""
    seen = "y" if unseen == "x" else "x"
    return (
        f"No light shows slopes along {unseen}: the caliper measured {seen} alone, and {unseen} "
        "follows in the proportion of the pad that is assumed (--design gives its own)."
    )


def _off(pad_size_mm: Pair, design: Wedge) -> float:
    """Share by which a side differs, of the one that differs more."""
    return max(abs(a / b - 1) for a, b in zip(pad_size_mm, design.pad_size_mm, strict=True))


def _sizes(pad_size_mm: Pair, design: Wedge) -> str:
    (x, y), (length, width) = pad_size_mm, design.pad_size_mm
    return f"{x:.4g} x {y:.4g} mm, the design {design.name} one of {length:g} x {width:g} mm"
