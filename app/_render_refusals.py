# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge simulate` and `wedge sweep` refuse before they render."""

import sys

from sensor.design import Wedge
from sensor.errors import WedgeError
from sensor.extras import how_to_install


def refuse_numbers(width_px: int, samples: int) -> None:
    """Refuse sizes of a render that cannot be meant.

    Raises:
        WedgeError: names the option, its value and its bounds.
    """
    if not 16 <= width_px <= 4096:
        raise WedgeError(f"--width-px {width_px} must be from 16 to 4096.")
    if not 1 <= samples <= 65536:
        raise WedgeError(f"--samples {samples} must be from 1 to 65536.")


def refuse_unbuildable(design: Wedge) -> None:
    """Refuse a design that could not be cut, where the solid modeller is there to tell.

    Raises:
        WedgeError: names the field, its value and the bound it breaks.
    """
    try:
        from cad.refusals import refuse_unbuildable as refuse
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError)  # and not a library of the system
        why = f"that needs {error.name}: {how_to_install('cad')}." if missing else str(error)
        print(f"not checked whether the design can be built: {why}", file=sys.stderr)
        return
    refuse(design)
