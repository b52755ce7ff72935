# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a good sensor must keep to, as data: a limit for each grade, and why."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Grade = Literal["A", "B", "fail"]
Parts = Mapping[str, float]
"""A measurement's values by what they belong to, a colour such as "R" or a light configuration such
as "RG"; "" where there is one value alone."""
Measured = Mapping[str, Parts]
"""By the names of ``LIMITS``; what could not be measured is absent."""
GROUPS = ("Errors", "Lights", "Gel", "Picture")
COUNTED = ("colours", "presses", "steps")
"""Units of what is counted, which has whole limits."""
DEAD_GRAY_LEVELS = 4.0
"""Contrast below which a colour says nothing about slopes."""


@dataclass(frozen=True, kw_only=True)
class Limit:
    """A measurement's limits; grade B holds between them."""

    name: str
    title: str
    unit: str
    grade_a: float
    grade_b: float
    """Beyond it the sensor fails. Above ``grade_a``: less is better; below: more is better."""
    reason: str
    group: str

    @property
    def less_is_better(self) -> bool:
        """Whether a sensor is good below its limits."""
        return self.grade_b > self.grade_a

    @property
    def shown_times(self) -> float:
        """Shares are shown in percent."""
        return 100.0 if self.name.endswith("_share") else 1.0

    def grade(self, value: float) -> Grade:
        """The grade of a value; what is no number fails."""
        sign = 1 if self.less_is_better else -1
        if sign * value <= sign * self.grade_a:
            return "A"
        return "B" if sign * value <= sign * self.grade_b else "fail"

    def worst(self, parts: Parts) -> tuple[str, float]:
        """The part that decides, and its value; what is no number comes first."""
        sign = 1 if self.less_is_better else -1
        return max(parts.items(), key=lambda item: (item[1] != item[1], sign * item[1]))


LIMITS = (
    Limit(
        group="Errors",
        name="theta_x_deg",
        title="error of θx on contact",
        unit="°",
        grade_a=4.0,
        grade_b=8.0,
        reason="published calibrations have errors of 3 to 5° on balls; beyond 8° a shape is lost",
    ),
    Limit(
        group="Errors",
        name="theta_y_deg",
        title="error of θy on contact",
        unit="°",
        grade_a=4.0,
        grade_b=8.0,
        reason="as for θx; the worse axis decides what can be measured",
    ),
    Limit(
        group="Errors",
        name="inferred_axis_deg",
        title="error of the axis no light sees",
        unit="°",
        grade_a=8.0,
        grade_b=16.0,
        reason="it is inferred from the other axis; if it is called flat, the error is the slope"
        " itself",
    ),
    Limit(
        group="Errors",
        name="fewer_lights_x_deg",
        title="error of θx with fewer lights",
        unit="°",
        grade_a=7.0,
        grade_b=12.0,
        reason="up to three quarters more than with all lights: each colour must contribute its"
        " share",
    ),
    Limit(
        group="Errors",
        name="fewer_lights_y_deg",
        title="error of θy with fewer lights",
        unit="°",
        grade_a=7.0,
        grade_b=12.0,
        reason="as for θx; if only one light sees an axis, no other can correct it",
    ),
    Limit(
        group="Errors",
        name="depth_rmse_share",
        title="depth error on balls",
        unit="% of the depth",
        grade_a=0.15,
        grade_b=0.3,
        reason="the depth of a ball pressed in by 1 mm must be known to 0.15 mm to tell a grip"
        " from a touch",
    ),
    Limit(
        group="Errors",
        name="ball_radius_share",
        title="error of the radius fitted to slopes",
        unit="% of the ball's",
        grade_a=0.1,
        grade_b=0.2,
        reason="the slopes fit another ball: radius or scale is wrong, or the gel reads too flat",
    ),
    Limit(
        group="Errors",
        name="steepest_deg",
        title="steepest slope of the presses",
        unit="°",
        grade_a=35.0,
        grade_b=20.0,
        reason="a small error on shallow slopes means little; a radius stated too large flattens"
        " slopes too",
    ),
    Limit(
        group="Errors",
        name="usable_presses",
        title="usable presses of the set",
        unit="presses",
        grade_a=10.0,
        grade_b=5.0,
        reason="single presses scatter: what so few of them show may be luck",
    ),
    Limit(
        group="Lights",
        name="contrast_gray_levels",
        title="contrast inside a contact",
        unit="grey levels",
        grade_a=8.0,
        grade_b=DEAD_GRAY_LEVELS,
        reason="if an LED is dead or covered, its colour does not change inside a contact",
    ),
    Limit(
        group="Lights",
        name="swapped_lights",
        title="colours in each other's place",
        unit="colours",
        grade_a=0.0,
        grade_b=0.5,
        reason="swapped wires or colour channels, or a mirrored picture, turn slopes the wrong way",
    ),
    Limit(
        group="Lights",
        name="lights_turned_deg",
        title="rotation of all lights together",
        unit="°",
        grade_a=10.0,
        grade_b=20.0,
        reason="a camera or light board turned by 20° puts a third of each slope on the other axis",
    ),
    Limit(
        group="Lights",
        name="cross_talk_share",
        title="cross-talk between colours",
        unit="% sideways",
        grade_a=0.25,
        grade_b=0.5,
        reason="a colour that responds across its own light sees another light; at 50 % the two"
        " axes blur",
    ),
    Limit(
        group="Lights",
        name="axes_ratio",
        title="ratio of best to worst seen axis",
        unit="times",
        grade_a=4.0,
        grade_b=8.0,
        reason="the weakly seen axis has this many times the noise of the other",
    ),
    Limit(
        group="Lights",
        name="evenness_share",
        title="evenness: darkest to brightest",
        unit="%",
        grade_a=0.2,
        grade_b=0.08,
        reason="where a light has faded to a tenth, the noise is ten times the signal of a slope",
    ),
    Limit(
        group="Lights",
        name="saturated_share",
        title="saturated pixels",
        unit="% of contacts",
        grade_a=0.05,
        grade_b=0.3,
        reason="a saturated colour no longer changes with the slope; only the others still do",
    ),
    Limit(
        group="Lights",
        name="color_balance_share",
        title="weakest to strongest colour",
        unit="%",
        grade_a=0.4,
        grade_b=0.2,
        reason="the white balance is wrong: a fifth of another colour's signal means five times"
        " its noise",
    ),
    Limit(
        group="Lights",
        name="brightness_change_share",
        title="brightness since calibration",
        unit="% changed",
        grade_a=0.1,
        grade_b=0.25,
        reason="faded light has less contrast, uneven misreads slopes; on 95 % of the pad at most",
    ),
    Limit(
        group="Gel",
        name="noise_gray_levels",
        title="noise of untouched gel",
        unit="grey levels",
        grade_a=2.0,
        grade_b=4.0,
        reason="a slope of 1° changes a colour by about 1 to 2 grey levels",
    ),
    Limit(
        group="Gel",
        name="drift_gray_levels",
        title="drift from the blank frame",
        unit="grey levels",
        grade_a=6.0,
        grade_b=12.0,
        reason="the estimator corrects 10 grey levels of drift; beyond, exposure or gain is not"
        " fixed",
    ),
    Limit(
        group="Gel",
        name="lit_share",
        title="lit area",
        unit="% of the pad",
        grade_a=0.95,
        grade_b=0.85,
        reason="slopes cannot be seen in the dark",
    ),
    Limit(
        group="Gel",
        name="usable_share",
        title="usable area",
        unit="% of the pad",
        grade_a=0.9,
        grade_b=0.75,
        reason="lit, not saturated, not worn, and low enough in noise to know a slope to 0.05 (3°)",
    ),
    Limit(
        group="Gel",
        name="covered_share",
        title="area covered by presses",
        unit="% of the pad",
        grade_a=0.5,
        grade_b=0.3,
        reason="light varies over the pad: where no press of this set reaches, errors are unknown",
    ),
    Limit(
        group="Gel",
        name="worn_share",
        title="scratched or worn skin",
        unit="% of the pad",
        grade_a=0.01,
        grade_b=0.04,
        reason="a torn film shines through, and its edges look like contact",
    ),
    Limit(
        group="Picture",
        name="moved_px",
        title="picture moved since calibration",
        unit="px",
        grade_a=1.0,
        grade_b=3.0,
        reason="if moved, every edge of the pad is a false slope; unknown: also dirt, wear,"
        " another sensor",
    ),
    Limit(
        group="Picture",
        name="out_of_round_share",
        title="unwarp: discs out of round",
        unit="% of the diameter",
        grade_a=0.04,
        grade_b=0.08,
        reason="a picture stretched by 8 % makes slopes and lengths wrong by 8 % along one axis",
    ),
    Limit(
        group="Picture",
        name="bent_grid_share",
        title="unwarp: dots off a straight grid",
        unit="% of spacing",
        grade_a=0.08,
        grade_b=0.16,
        reason="printed rows of dots are straight: if they appear bent, lens or corners are wrong",
    ),
    Limit(
        group="Picture",
        name="lens_rms_px",
        title="unwarp: chessboards off the lens",
        unit="px",
        grade_a=0.5,
        grade_b=1.0,
        reason="if the lens is known to one pixel, a ball's rim is off by a pixel, like a"
        " hand-drawn circle",
    ),
    Limit(
        group="Picture",
        name="frame_rate_hz",
        title="frame rate",
        unit="frames/s",
        grade_a=25.0,
        grade_b=10.0,
        reason="a slip lasts a tenth of a second: below 10 frames per second it is missed",
    ),
    Limit(
        group="Picture",
        name="jitter_ms",
        title="jitter between frames",
        unit="ms",
        grade_a=5.0,
        grade_b=20.0,
        reason="at 50 mm/s, a time that is wrong by 20 ms means 1 mm of travel",
    ),
    Limit(
        group="Picture",
        name="longest_gap_ms",
        title="longest gap between frames",
        unit="ms",
        grade_a=100.0,
        grade_b=500.0,
        reason="a single stall of half a second loses a grip, whatever the frame rate otherwise",
    ),
    Limit(
        group="Picture",
        name="backward_steps",
        title="times that do not increase",
        unit="steps",
        grade_a=0.0,
        grade_b=0.5,
        reason="a clock was set back, or two frames have the same time: touches cannot be timed",
    ),
    Limit(
        group="Picture",
        name="lost_share",
        title="lost frames",
        unit="%",
        grade_a=0.01,
        grade_b=0.05,
        reason="motion in lost frames cannot be followed: dots jump to their neighbours' places",
    ),
)


def grade_of(limit: Limit, parts: Parts) -> Grade:
    """The grade of a measurement: its worst part's."""
    return limit.grade(limit.worst(parts)[1])


def grades(measured: Measured) -> dict[str, Grade]:
    """The grade of each measurement that was made, in the order of ``LIMITS``."""
    return {
        limit.name: grade_of(limit, measured[limit.name])
        for limit in LIMITS
        if limit.name in measured
    }


def verdict(measured: Measured) -> Grade:
    """The worst grade decides."""
    found = grades(measured).values()
    return "fail" if "fail" in found else "B" if "B" in found else "A"


def limit_called(name: str) -> Limit:
    """The limit of that name."""
    return next(limit for limit in LIMITS if limit.name == name)
