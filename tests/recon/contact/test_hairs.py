# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is long and thin is no contact: a hair, and gel that two contacts stretch between them."""

import numpy as np
import pytest

from recon.contact.disturbed import large_patches
from recon.contact.mask import with_crests

ROWS, COLUMNS = np.indices((240, 320))


def disc(x, y, radius):
    return np.hypot(COLUMNS - x, ROWS - y) < radius


@pytest.mark.parametrize(("width_px", "kept"), [(4, False), (9, True)])
@pytest.mark.parametrize("turned", [False, True])
def test_a_hair_is_no_contact_however_long(width_px, kept, turned):
    mask = np.zeros(ROWS.shape, bool)
    mask[100 : 100 + width_px, 20:220] = True
    assert large_patches(mask.T if turned else mask).any() == kept


def test_gel_between_a_contact_and_a_crest_is_of_the_nearer_one():
    """What hangs together with a crest beyond the contours reaches up to the contact itself."""
    head, beside = disc(90, 120, 40), disc(230, 120, 24)
    bridge = (abs(ROWS - 120) < 8) & (COLUMNS > 90) & (COLUMNS < 230) & ~head & ~beside
    depth = 1.0 * head + 0.2 * (beside | bridge)
    gradient = np.zeros((*ROWS.shape, 2))
    gradient[head | bridge] = 0.5  # a flank is no crest
    found = with_crests(head, head | bridge | beside, gradient, depth, depth * (1 + 0.4 * beside))
    assert found[beside].mean() > 0.9
    assert not found[bridge & (COLUMNS < 150)].any()
