# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.contact.first_contact import first_contact, touches


@pytest.mark.parametrize(
    ("touching", "first"),
    [
        ([False, False, True, False, True, True, True, False], 4),
        ([True, True, True, True], 0),
        ([False, True, True, False, True, True], None),
        ([], None),
    ],
)
def test_the_first_contact_is_the_first_frame_of_a_lasting_one(touching, first):
    assert first_contact(touching) == first


def test_a_frame_that_differs_all_over_shows_no_contact():
    part = np.zeros((30, 40), bool)
    part[10:20, 10:20] = True
    assert touches(part, part)
    assert not touches(part, np.ones_like(part))
    assert not touches(np.zeros_like(part), part)
