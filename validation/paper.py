# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Table I of the paper: gradient errors of the first GelSight Wedge per light configuration.

S. Wang, Y. She, B. Romero, E. Adelson, GelSight Wedge: Measuring High-Resolution 3D Contact
Geometry with a Compact Robot Finger, ICRA 2021. Its pixels are contact pixels and 5 % of the
others, of 8 presses; its sensor, its presses and its slopes are other ones than here.
"""

from collections.abc import Collection, Mapping

from sensor.unit import MissingAxis

PAPER_PIXELS = "contact+5%"
Line = tuple[str, MissingAxis]
"""Lit colours, and what stands in for an axis that they leave unseen."""
PAPER_TABLE: Mapping[Line, Mapping[str, float]] = {
    ("R", "zero"): {"gx_mae": 0.104, "gy_mae": 0.055, "theta_x_deg": 5.598, "theta_y_deg": 2.889},
    ("R", "network"): {
        "gx_mae": 0.055,
        "gy_mae": 0.055,
        "theta_x_deg": 2.899,
        "theta_y_deg": 2.897,
    },
    ("RB", "zero"): {"gx_mae": 0.106, "gy_mae": 0.045, "theta_x_deg": 5.706, "theta_y_deg": 2.349},
    ("RB", "network"): {
        "gx_mae": 0.051,
        "gy_mae": 0.045,
        "theta_x_deg": 2.656,
        "theta_y_deg": 2.351,
    },
    ("RG", "none"): {"gx_mae": 0.045, "gy_mae": 0.044, "theta_x_deg": 2.331, "theta_y_deg": 2.293},
    ("RGB", "none"): {"gx_mae": 0.043, "gy_mae": 0.042, "theta_x_deg": 2.248, "theta_y_deg": 2.187},
}


def paper_errors(lines: Collection[Line]) -> dict[Line, Mapping[str, float]]:
    """The paper's errors of those lines of a table that can be held against them.

    Its red light alone, and red and blue, leave x unseen. Where lights sit otherwise, as further
    lines tell, the same colours leave y unseen or nothing: only lines that infer nothing compare.
    """
    sit_alike = set(lines) <= set(PAPER_TABLE)
    return {
        line: PAPER_TABLE[line]
        for line in lines
        if line in PAPER_TABLE and (sit_alike or line[1] == "none")
    }
