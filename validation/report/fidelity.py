# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside real sensors, as a section of the page."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from validation.fidelity import Likeness, Transfer
from validation.intervals import remark
from validation.report.page import Section, paragraph, table_html

NOTHING = "–"


def fidelity_section(sensors: Sequence[Likeness], transfers: Sequence[Transfer]) -> Section:
    """The same numbers of rendered and real sensors, and networks that cross over."""
    judged = [item.errors.n_presses for item in transfers]
    return Section(
        title="Is the twin true?",
        html=paragraph(
            "The rendered sets come from the design's numbers alone. Here they are compared with "
            "real frames, measured in the same way. Light is linear light, by a gamma of 2.2. The "
            "sensors differ in size, gel, ball and exposure, so equal numbers are not expected; a "
            "difference by a factor means a fault of the twin or another design."
        )
        + table_html(
            "Rendered and real sensors; a dash if a set does not show the number. Near/far: light"
            " on the third of the pad next to the colour's own side, divided by that on the"
            " farthest third. Lobe: grey levels per unit of slope toward the light (least squares"
            " over contact pixels), and the same across it.",
            ["figure", *(sensor.name for sensor in sensors)],
            [[name, *(cell(sensor) for sensor in sensors)] for name, cell in FIGURES.items()],
        )
        + paragraph(
            "A network trained on one set and judged on another shows how different the two are for"
            " a calibration. On the diagonal, a fifth of the set's own presses is held out. None of"
            " the other cells is good enough to use: calibrate every unit on its own presses."
        )
        + table_html(
            "Mean absolute errors of Gx and Gy on contact pixels, all lights, the paper's "
            "network. Rows: trained on; columns: judged on; "
            + remark("in brackets: press-level bootstrap 95 % intervals", *judged)
            + ". Sensors are turned so that red shines from the same side.",
            ["trained on", *dict.fromkeys(item.judged for item in transfers)],
            _crossed(transfers),
        ),
    )


def _crossed(transfers: Sequence[Transfer]) -> list[list[str]]:
    rows: dict[str, list[str]] = {}
    for item in transfers:
        values, ci95 = item.errors.values, item.errors.ci95
        cell = f"{values['gx_mae']:.3f} / {values['gy_mae']:.3f}"
        known = [interval for metric in ("gx_mae", "gy_mae") if (interval := ci95[metric])]
        below = " ".join(f"[{low:.3f}, {high:.3f}]" for low, high in known)
        rows.setdefault(item.learnt, []).append(f"{cell}\n{below}")
    return [[learnt, *cells] for learnt, cells in rows.items()]


def _number(name: str, form: str = "{:.2f}") -> Callable[[Likeness], str]:
    def cell(sensor: Likeness) -> str:
        value = getattr(sensor, name)
        return NOTHING if value is None or np.isnan(value) else form.format(value)

    return cell


def _colors(name: str, form: str) -> Callable[[Likeness], str]:
    def cell(sensor: Likeness) -> str:
        values: Mapping[str, float] | None = getattr(sensor, name)
        if values is None:
            return NOTHING
        return " / ".join(form.format(values[color]) for color in "RGB" if color in values)

    return cell


FIGURES: Mapping[str, Callable[[Likeness], str]] = {
    "labelled presses": _number("presses", "{}"),
    "keystone of the pad": _number("keystone"),
    "unevenness of the blank gel (SD / mean)": _number("unevenness"),
    "near/far, R / G / B": _colors("near_far", "{:.1f}"),
    "lobe, R / G / B [grey levels per slope]": _colors("levels_per_slope", "{:.0f}"),
    "across the lobe, R / G / B [share]": _colors("off_axis", "{:.2f}"),
    "contrast of contacts [grey levels]": _number("contrast", "{:.0f}"),
    "mean |G| of the same contacts": _number("mean_abs_gradient"),
    "grain of the difference [grey levels]": _number("grain", "{:.1f}"),
}
