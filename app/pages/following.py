# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The touched object's pose and the gel's dots, as the live page shows them."""

from dataclasses import dataclass

import numpy as np

from app.pages import pictures
from recon.follower import Felt
from recon.pose.estimate import PoseEstimate
from recon.pose.rigid import Points, turn_and_shift
from validation.figures.markers import draw_arrows, marker_words
from validation.figures.tracking import anchor_on, pose_picture


@dataclass(frozen=True, kw_only=True)
class Followed:
    """What the page shows of one moment."""

    picture: str
    """The gel with the object's axes and the dots' arrows, as a data URL."""
    state: str
    pose: str
    markers: str


APART = "each picture is a separate touch: no pose is tracked"


class PoseView:
    """Draws what is felt; keeps the object's axes where the object was first deepest."""

    def __init__(self, apart: bool) -> None:
        """Begin; no pose is told or drawn where frames are ``apart``, each a touch of its own."""
        self._apart = apart
        self._anchor: Points | None = None
        self._object_number = 0

    def __call__(self, felt: Felt) -> Followed:
        """The next moment."""
        if felt.object_number != self._object_number:
            self._anchor, self._object_number = None, felt.object_number
        touch, pose = felt.touch, felt.pose.T_sensor_object
        is_alone = self._apart and pose is not None
        if self._anchor is None and pose is not None and not is_alone:
            self._anchor = anchor_on(touch, pose, felt.gel)
        shown = pose_picture(felt.image, touch.contact, touch.mm_per_px, felt.pose, self._anchor)
        words = "none on this gel" if felt.markers == "none" else felt.markers
        if felt.dots is not None:
            draw_arrows(shown, felt.dots, shown.shape[1] / felt.image.shape[1])
            misfit = "" if felt.markers == felt.dots.word else f"; {felt.markers}"
            words = marker_words(felt.dots, touch.mm_per_px) + misfit
        return Followed(
            picture=pictures.as_url(shown),
            state="–" if is_alone else felt.pose.state,
            pose=APART if is_alone else pose_words(felt.pose),
            markers=words,
        )


def pose_words(found: PoseEstimate) -> str:
    """Turn and shift with a standard deviation each, or why there are none."""
    if found.T_sensor_object is None:
        return found.reason
    turn, shift = np.split(turn_and_shift(found.T_sensor_object), 2)
    return (
        "turn {:+.1f} {:+.1f} {:+.1f}° ± {:.1f}°, ".format(
            *np.degrees(turn), found.rotation_std_deg
        )
        + "shift {:+.2f} {:+.2f} {:+.2f} mm ± {:.2f} mm".format(*shift, found.translation_std_mm)
        + (f"; {found.reason}" if found.reason else "")
    )
