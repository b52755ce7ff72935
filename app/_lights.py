# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Colours that no press shows a light of, or one of a light that the sensor does not have."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from sensor.dataset import CARD_FILE
from sensor.design import Wedge

if TYPE_CHECKING:
    from recon.pixels import BallPress
    from sensor.dataset import Dataset, DatasetCard

COLORS = {"R": "red", "G": "green", "B": "blue"}
LEDS = {"R": "red_side_leds", "G": "green_base_leds", "B": "blue_side_leds"}
"""Of a design's lights, how many each colour has."""
NUMBERS = ("no light", "one light", "two lights")
OFF_DEG = 45.0
"""So far from where a light is stated, another axis or another colour's place is nearer."""
TURNED = "the picture is mirrored or turned, or colours or wires are exchanged; correct that first."


def with_designed_lights(card: "DatasetCard", design: Wedge | None) -> "DatasetCard":
    """The card with the lights of its design: where presses show them, else where they should sit.

    Whoever calibrates by it then learns from a dead light as from any, and `wedge accept` fails it.
    A colour that shows the light of another, as a camera's filters overlap, has none of its own.
    """
    if design is None or card.lights_deg is None:
        return card
    designed: dict[str, float] = {c: at for c, at in design.lights.azimuths_deg.items()}
    shown = {c: at for c, at in card.lights_deg.items() if c in designed}
    return replace(card, lights_deg=designed | shown)


def with_dead_lights(dataset: "Dataset", design: Wedge | None) -> tuple["DatasetCard", str]:
    """The card with the lights that its design has and no press shows, and what to say of those.

    A colour that a card leaves out though presses show it is left out on purpose, and stays so.
    """
    from validation.importers.folder import lit

    card = dataset.card
    if design is None or card.lights_deg is None:
        return card, ""
    if set(card.lights_deg) >= set(design.lights.azimuths_deg):
        return card, ""
    alive = {**(lit(dataset).lights_deg or {}), **card.lights_deg}
    every = with_designed_lights(replace(card, lights_deg=alive), design).lights_deg or {}
    dead = {color: at for color, at in every.items() if color not in alive}
    remark = _dark({c: at for c, at in alive.items() if c in every}, design)
    return replace(card, lights_deg=dict(card.lights_deg) | dead), remark


def misplaced_remark(
    dataset: "Dataset", presses: "Sequence[BallPress]", design: Wedge | None
) -> str:
    """What to say of lights that presses show elsewhere than they are stated, or designed.

    Empty where there is nothing to say, or where the presses do not tell it beyond doubt.

    Args:
        dataset: whose card states the lights, or does not.
        presses: of the dataset.
        design: whose lights the sensor should have, where one is named.
    """
    from validation.acceptance.lights import turn_deg
    from validation.importers.lights import sure_lights_deg

    stated, said_by = dataset.card.lights_deg, f"{dataset.folder / CARD_FILE} states"
    found = sure_lights_deg(presses)
    if stated is not None:
        found = {color: at for color, at in found.items() if color in stated}
    swapped = _swapped({**(stated or {}), **found}, design)
    if stated is None and design is not None and not swapped:
        stated = {str(color): at for color, at in design.lights.azimuths_deg.items()}
        said_by = f"the design {design.name} has"
    off = {
        color: at
        for color, at in found.items()
        if stated and color in stated and abs(turn_deg(at - stated[color])) > OFF_DEG
    }
    if not stated or not off:
        return swapped
    remark = (
        f"The presses show lights at {_named_deg(off)}, but {said_by} "
        f"{_named_deg({color: stated[color] for color in off})}"
    )
    if swapped:
        return f"{remark}. {swapped}"
    if dataset.card.lights_deg is None:
        return f"{remark}: {TURNED}"
    return f"{remark}: correct lights_deg there, or, if it is right, {TURNED[:-1]}."


def lights_remark(lights_deg: Mapping[str, float] | None, design: Wedge | None) -> str:
    """What to say of colours without a light, with another's, or that no light should have.

    Empty where there is nothing to say.

    Args:
        lights_deg: where presses show lights; ``None`` where nobody said.
        design: whose lights the sensor should have, where one is named.
    """
    if lights_deg is None:
        return ""
    remarks = [f(lights_deg, design) for f in (_dark, _not_designed, _swapped)]
    return " ".join(remark for remark in remarks if remark)


def one_line_remark(dataset: "Dataset", presses: "Sequence[BallPress]") -> str:
    """Ask where the lights are: nobody said, and presses show slopes along one line only.

    Empty where there is nothing to ask. The limit is the one beyond which `wedge accept` fails a
    sensor: real and rendered ones reach 1.7, single presses of them 2.5; red and blue alone 11.
    """
    from validation.acceptance.lights import light_response
    from validation.acceptance.limits import limit_called
    from validation.importers.lights import measure_lights_deg
    from validation.lighting import axes_ratio

    if dataset.card.lights_deg is not None:
        return ""
    ratio = axes_ratio(light_response(presses).slopes)
    if limit_called("axes_ratio").grade(ratio) != "fail":
        return ""
    found = ", ".join(f"{color} = {at}" for color, at in measure_lights_deg(presses).items())
    return (
        f"The lights show slopes along one line only: write lights_deg = {{{found}}} into "
        f"{dataset.folder / CARD_FILE} and calibrate again, so that the other slope is inferred."
    )


def _dark(lights_deg: Mapping[str, float], design: Wedge | None) -> str:
    wanted = COLORS if design is None else design.lights.azimuths_deg
    dark = [COLORS[color] for color in COLORS if color in wanted and color not in lights_deg]
    if not dark:
        return ""
    one = len(dark) == 1
    shown = f"{' and '.join(dark).capitalize()} {'shows' if one else 'show'} no light"
    dead = "its LED is dead" if one else "their LEDs are dead"
    if design is not None:
        counts = " and ".join(f"lights.{LEDS[c]} = 0" for c in COLORS if COLORS[c] in dark)
        return (
            f"{shown}, but the design {design.name} has {'one' if one else 'them'}: {dead}, and no "
            f"slope is inferred in {'its' if one else 'their'} place. If the sensor has "
            f"{'none' if one else 'neither'} on purpose, give a design file with {counts}."
        )
    return (
        f"{shown}: the sensor is taken to have {NUMBERS[len(lights_deg)]}; if it should have "
        f"{'that one' if one else 'them'} too, {dead}."
    )


def _not_designed(lights_deg: Mapping[str, float], design: Wedge | None) -> str:
    if design is None:
        return ""
    designed = design.lights.azimuths_deg
    others = [COLORS[color] for color in COLORS if color in lights_deg and color not in designed]
    if not others:
        return ""
    one = len(others) == 1
    return (
        f"{' and '.join(others).capitalize()} {'changes' if one else 'change'} with the presses, "
        f"but the design {design.name} has no such light: what {'it shows' if one else 'they show'}"
        " is taken for light of other colours and left out."
    )


def _swapped(lights_deg: Mapping[str, float], design: Wedge | None) -> str:
    from validation.acceptance.lights import swapped_colors

    if design is None:
        return ""
    designed: dict[str, float] = {c: at for c, at in design.lights.azimuths_deg.items()}
    if not (swapped := swapped_colors(lights_deg, designed)):
        return ""
    *others, last = [COLORS[color] for color in COLORS if color in swapped]
    return (
        f"{', '.join(others).capitalize()} and {last} lie in each other's place, as the design "
        f"{design.name} has them: {TURNED}"
    )


def _named_deg(lights_deg: Mapping[str, float]) -> str:
    return ", ".join(f"{color} = {lights_deg[color]:g}°" for color in COLORS if color in lights_deg)
