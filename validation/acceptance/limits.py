# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a good sensor must keep to, as data: a limit for each grade, and why."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Grade = Literal["A", "B", "fail"]


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

    @property
    def less_is_better(self) -> bool:
        """Whether a sensor is good below its limits."""
        return self.grade_b > self.grade_a

    def grade(self, value: float) -> Grade:
        """The grade of a value; what is no number fails."""
        sign = 1 if self.less_is_better else -1
        if sign * value <= sign * self.grade_a:
            return "A"
        return "B" if sign * value <= sign * self.grade_b else "fail"


LIMITS = (
    Limit(
        name="theta_x_deg",
        title="error of θx on contact",
        unit="°",
        grade_a=4.0,
        grade_b=8.0,
        reason="published calibrations of a ball's slope lie at 3 to 5°; beyond 8° a shape is lost",
    ),
    Limit(
        name="theta_y_deg",
        title="error of θy on contact",
        unit="°",
        grade_a=4.0,
        grade_b=8.0,
        reason="as for θx; the worse axis decides what can be measured",
    ),
    Limit(
        name="depth_rmse_share",
        title="depth error on balls",
        unit="of the depth",
        grade_a=0.15,
        grade_b=0.3,
        reason="a ball pressed 1 mm deep must be known to 0.15 mm to tell a grip from a touch",
    ),
    Limit(
        name="noise_grey_levels",
        title="noise of untouched gel",
        unit="grey levels",
        grade_a=2.0,
        grade_b=4.0,
        reason="a slope of 1° changes a colour by about 1 to 2 grey levels",
    ),
    Limit(
        name="drift_grey_levels",
        title="drift of untouched gel",
        unit="grey levels",
        grade_a=6.0,
        grade_b=12.0,
        reason="the estimator takes off a drift of 10 grey levels; exposure or gain is not locked",
    ),
    Limit(
        name="least_evenness",
        title="evenness of the worst light",
        unit="darkest to brightest",
        grade_a=0.2,
        grade_b=0.08,
        reason="where a light has faded to a tenth, its noise is ten times the slope's signal",
    ),
    Limit(
        name="saturated_share",
        title="saturated pixels",
        unit="of the frame",
        grade_a=0.005,
        grade_b=0.03,
        reason="a saturated colour no longer changes with the slope",
    ),
    Limit(
        name="least_contrast_grey_levels",
        title="contrast of the weakest colour",
        unit="grey levels",
        grade_a=8.0,
        grade_b=4.0,
        reason="a dead or masked LED leaves its colour without change inside a contact",
    ),
    Limit(
        name="lights_turned_deg",
        title="lights away from where they belong",
        unit="°",
        grade_a=15.0,
        grade_b=30.0,
        reason="swapped colours or LEDs, or a turned picture, send a slope to the wrong axis",
    ),
    Limit(
        name="axes_ratio",
        title="cross-talk: best over worst seen axis",
        unit="",
        grade_a=4.0,
        grade_b=8.0,
        reason="lights that leak into each other's colour, or a wrong white balance, see one axis",
    ),
    Limit(
        name="color_balance",
        title="balance of the blank gel's colours",
        unit="weakest to strongest",
        grade_a=0.4,
        grade_b=0.2,
        reason="a colour of a fifth of another's signal carries five times its share of noise",
    ),
    Limit(
        name="lit_share",
        title="lit area of the pad",
        unit="of the pad",
        grade_a=0.95,
        grade_b=0.85,
        reason="no slope is seen in the dark",
    ),
    Limit(
        name="covered_share",
        title="area of the pad that presses cover",
        unit="of the pad",
        grade_a=0.5,
        grade_b=0.3,
        reason="light changes across the pad: where no ball was pressed, nothing was learnt",
    ),
    Limit(
        name="moved_px",
        title="shift against the calibrated picture",
        unit="px",
        grade_a=1.0,
        grade_b=3.0,
        reason="a camera or mirror that has moved turns every edge of the pad into a false slope",
    ),
    Limit(
        name="worn_share",
        title="scratched or worn skin",
        unit="of the pad",
        grade_a=0.01,
        grade_b=0.04,
        reason="a torn film shines through, and its edges look like contact",
    ),
)


def grades(values: Mapping[str, float]) -> dict[str, Grade]:
    """The grade of each measurement that was made, in the order of ``LIMITS``."""
    return {limit.name: limit.grade(values[limit.name]) for limit in LIMITS if limit.name in values}


def verdict(values: Mapping[str, float]) -> Grade:
    """The worst grade decides."""
    found = grades(values).values()
    return "fail" if "fail" in found else "B" if "B" in found else "A"
