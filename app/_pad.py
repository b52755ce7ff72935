# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How large a pad is taken to be that nothing has measured, and whether it is the design's."""

from sensor.design import STANDARD, Wedge
from sensor.errors import WedgeError
from sensor.toml import Pair

OTHER_PAD = 0.2
"""Share by which a pad that was measured may differ from its design's; real Wedges do by 0.09."""


def assumed_pad_mm(design: Wedge | None, pad_size_mm: Pair | None = None) -> Pair:
    """The pad along x and y: as given, else the design's, else the standard's.

    Raises:
        WedgeError: both are given, or a length that no pad has.
    """
    if design is not None and pad_size_mm is not None:
        raise WedgeError("--design and --pad-size-mm both say how large the pad is: give one.")
    if pad_size_mm is not None and not all(1 <= side < 1e3 for side in pad_size_mm):
        raise WedgeError("--pad-size-mm must be two lengths of at least 1 mm.")
    return pad_size_mm or (design or STANDARD).pad_size_mm


def refuse_other_pad(pad_size_mm: Pair | None, design: Wedge | None, where: str) -> None:
    """Refuse a design that has another pad than a card states, where both are known.

    Raises:
        WedgeError: names ``where`` and both sizes.
    """
    if design is None or pad_size_mm is None:
        return
    shares = [a / b for a, b in zip(pad_size_mm, design.pad_size_mm, strict=True)]
    if not all(1 - OTHER_PAD < share < 1 + OTHER_PAD for share in shares):
        (x, y), (length, width) = pad_size_mm, design.pad_size_mm
        raise WedgeError(
            f"{where} has a pad of {x:g} x {y:g} mm, the design {design.name} one of {length:g} x "
            f"{width:g} mm: name the sensor's own design, or mend pad_size_mm."
        )
