# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of a gel's dots, given its blank frame and the unit's record of them."""

from collections.abc import Mapping

from recon.arrays import Unwarped
from recon.markers.detection import unexpected_dots
from recon.markers.tracking import MarkerTracker, Tracked, marker_tracker

FINE = 0.4
"""Of the frame: dots that hide more at rest may hide nearly all of it once they have moved."""
MOST_HIDDEN = 0.8
"""Of the frame: what lies between so many dots is not enough to tell of a contact."""


class DotWatch:
    """Finds the dots of one gel on its blank frame, and has the word on those of each frame."""

    def __init__(self, blank: Unwarped, recorded: Mapping[str, int | float] | None) -> None:
        """Look at the gel.

        Args:
            blank: the unwarped blank frame.
            recorded: the unit's card's ``markers``.
        """
        self.blank = blank
        self.tracker = marker_tracker(blank)
        self._misfit = misfit(recorded, self.tracker)
        self._fine = self.tracker is not None and self.tracker.hidden().mean() > FINE

    def word(self, dots: Tracked | None) -> str:
        """A word on a frame: "tracked", "jumped", "lost", or what is wrong with the gel.

        Dots that are lost come first, as the frame alone tells that. Then what does not fit the
        unit, which puts in doubt what its dots say, and dots that leave hardly any gel to see.

        Args:
            dots: of the frame; ``None`` where the blank frame has none.

        Returns:
            The word; empty where only ``unexpected`` can tell.
        """
        word = "" if dots is None else dots.word
        return word if word == "lost" else self._misfit or self._too_fine(dots) or word

    def _too_fine(self, dots: Tracked | None) -> str:
        if not self._fine or self.tracker is None or dots is None:
            return ""
        hidden = float(self.tracker.hidden(dots).mean())
        return f"they hide {hidden:.0%} of the gel, touched or not" if hidden > MOST_HIDDEN else ""

    def unexpected(self, image: Unwarped) -> str:
        """The word on a frame where no dots should be: "none", or which there are.

        To find some takes many times what a frame without them does.
        """
        return unexpected_dots(image, self.blank) or "none"


def misfit(recorded: Mapping[str, int | float] | None, found: MarkerTracker | None) -> str:
    """What is wrong where a unit's record and a blank frame disagree about dots; else empty.

    Args:
        recorded: the card's ``markers``.
        found: on the blank frame.
    """
    if recorded is not None and found is None:
        return f"none, but the unit has {recorded['count']:g}: is this its gel, in focus?"
    if recorded is None and found is not None:
        return f"{len(found.markers)} dots, but the unit was calibrated without: calibrate it anew"
    return ""
