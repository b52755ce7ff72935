# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tracked poses: over time with their uncertainty, and drawn over the frames."""

from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from recon.arrays import ContactMask, GradientField, Unwarped
from recon.pose.estimate import PoseEstimate
from recon.pose.registration import Touch, contact_points, own
from recon.pose.rest import laid
from recon.pose.rigid import Points, Transform, applied, inverse, turn_and_shift
from sensor.design import Gel
from sensor.toml import Pair
from validation.figures.overlay import Picture, enlarged, with_words
from validation.figures.style import (
    BLUE,
    DASHES,
    FAINT,
    FULL_IN,
    GREEN,
    ORANGE,
    RED,
    SOFT,
    card,
    name_decades,
    styled,
)

AXES = (("x", BLUE), ("y", ORANGE), ("z", GREEN))
AXIS_MM = 3.0
LETTER_PX = 20
"""Of an axis' name: to be read where the picture is half as wide as it is drawn."""
LIGHT, DARK = (240, 240, 240), (20, 20, 20)
WORDS = {"tracking": (90, 200, 120), "weak": (240, 190, 70), "frozen": (90, 170, 240)}
"""RGB of a state's name; red for the rest."""
LOST = (255, 110, 90)


@styled
def pose_figure(times_s: Sequence[float], found: Sequence[PoseEstimate], title: str) -> Figure:
    """Rotation vector and translation against time, with two standard deviations.

    Grey: lost, no pose; hatched: a pose with a warning.
    """
    figure = card(FULL_IN, 4.6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    times = np.asarray(times_s, float)
    turn, shift, spread = series(found)
    for axes, values, deviation, unit in (
        (upper, turn, spread[:, :3], "rotation [°]"),
        (lower, shift, spread[:, 3:], "shift [mm]"),
    ):
        _shade(axes, times, found)
        known = np.isfinite([np.nan, *values[:, 0], np.nan])
        alone = known[1:-1] & ~known[:-2] & ~known[2:]  # what no line joins
        for index, (name, color) in enumerate(AXES):
            course = values[:, index]
            low = values[:, index] - 2 * deviation[:, index]
            high = values[:, index] + 2 * deviation[:, index]
            axes.fill_between(times, low, high, color=color, alpha=0.2, lw=0)
            axes.plot(times, course, color=color, ls=DASHES[index], label=name)
            axes.plot(times[alone], course[alone], ".", color=color, ms=3)
        finite = values[np.isfinite(values)]
        if len(finite):
            room = 0.15 * max(float(np.ptp(finite)), 0.1)
            axes.set_ylim(finite.min() - room, finite.max() + room)
        axes.set_ylabel(unit)
        axes.grid()
    upper.set_title(title)
    upper.legend(loc="upper left", ncols=5)
    lower.set_xlabel("time [s]")
    return figure


def series(
    found: Sequence[PoseEstimate],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n 6"]]:
    """Rotation vectors in degrees without jumps, shifts in mm, deviations; NaN where lost.

    Beyond half a turn a vector is that of the rest, and whole turns about the axis where it got
    there: near a whole turn, the vector of all of it would point anywhere.
    """
    turn, shift = np.full((len(found), 3), np.nan), np.full((len(found), 3), np.nan)
    spread = np.full((len(found), 6), np.nan)
    whole, last = np.zeros(3), np.zeros(3)
    for index, item in enumerate(found):
        if item.T_sensor_object is None or item.covariance is None:
            continue
        rest, shift[index] = np.split(turn_and_shift(item.T_sensor_object), 2)
        once = 2 * np.pi * rest / max(float(np.linalg.norm(rest)), 1e-12)
        choices = whole - once, whole, whole + once
        away = [np.linalg.norm(choice + rest - last) for choice in choices]
        whole = choices[int(np.argmin(away))]
        vector = last = whole + rest
        turn[index] = np.degrees(vector)
        deviation = np.sqrt(np.maximum(np.diag(item.covariance), 0))
        spread[index] = np.concatenate([np.degrees(deviation[:3]), deviation[3:]])
    return turn, shift, spread


def shaded(gradient: GradientField) -> Unwarped:
    """Slopes as a gray surface lit from the upper left, where there is no frame to draw on."""
    lit = 0.5 + 0.35 * (gradient[..., 0] + gradient[..., 1])
    return np.repeat(np.clip(lit, 0, 1)[..., None], 3, -1).astype(np.float32)


def anchor_on(touch: Touch, T_sensor_object: Transform, gel: Gel | None = None) -> Points:
    """The deepest point of a touch, in the object's frame: a place for its axes.

    Args:
        touch: as it was reconstructed.
        T_sensor_object: the object's pose in it.
        gel: a curved one on which the pose was found.
    """
    points = contact_points(laid(own(touch), gel))
    return applied(inverse(T_sensor_object), points[points[:, 2].argmin()])


def overlay(
    image: Unwarped,
    contact: ContactMask,
    mm_per_px: Pair,
    found: PoseEstimate,
    anchor_mm: Points | None,
) -> Picture:
    """A frame with the contact's outline, the object's axes and, below, the state in words.

    Args:
        image: the gel plane.
        contact: of the same pixels.
        mm_per_px: of both.
        found: what the tracker says.
        anchor_mm: the point of the object where its axes are drawn; ``None`` before there is one.
    """
    numbers = ""
    if found.T_sensor_object is not None:
        turn, shift = np.split(turn_and_shift(found.T_sensor_object), 2)
        numbers = "turn {:+.1f} {:+.1f} {:+.1f} deg   shift {:+.2f} {:+.2f} {:+.2f} mm".format(
            *np.degrees(turn), *shift
        )
    shown = pose_picture(image, contact, mm_per_px, found, anchor_mm)
    return with_words(shown, found.words, WORDS.get(found.state, LOST), numbers)


def pose_picture(
    image: Unwarped,
    contact: ContactMask,
    mm_per_px: Pair,
    found: PoseEstimate,
    anchor_mm: Points | None,
) -> Picture:
    """A frame with the contact's outline and the object's axes.

    Args:
        image: the gel plane.
        contact: of the same pixels.
        mm_per_px: of both.
        found: what the tracker says.
        anchor_mm: the point of the object where its axes are drawn; ``None`` before there is one.
    """
    picture = enlarged(image)
    size = picture.shape[1], picture.shape[0]
    mask = cv2.resize(contact.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    edges = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    cv2.drawContours(picture, edges, -1, (255, 255, 255), 1, cv2.LINE_AA)
    if found.T_sensor_object is not None and anchor_mm is not None:
        _draw_axes(picture, found.T_sensor_object, anchor_mm, mm_per_px, contact.shape[1])
    return picture


def _draw_axes(
    picture: Picture, pose: Transform, anchor_mm: Points, mm_per_px: Pair, columns: int
) -> None:
    """The object's axes at a point of it, seen straight through the gel of so many columns."""
    scale = picture.shape[1] / columns
    rows = picture.shape[0] / scale
    ends = anchor_mm + np.concatenate([np.zeros((1, 3)), AXIS_MM * np.eye(3)])
    seen = applied(pose, ends)
    x_px = (seen[:, 0] / mm_per_px[0] + (columns - 1) / 2 + 0.5) * scale
    y_px = (seen[:, 1] / mm_per_px[1] + (rows - 1) / 2 + 0.5) * scale
    places = np.clip(np.round(np.stack([x_px, y_px], 1)), -4000, 4000).astype(int)
    start = tuple(map(int, places[0]))
    ways = (places[1:] - places[0]).astype(float)
    for end, way, (name, color) in zip(places[1:], ways, AXES, strict=True):
        rgb = tuple(int(color[i : i + 2], 16) for i in (1, 3, 5))
        if np.hypot(*way) < LETTER_PX:  # seen from its tip: where the others leave room
            way = -ways.sum(axis=0)
        beyond = end + LETTER_PX * way / max(float(np.hypot(*way)), 1e-9)
        inside = np.clip(beyond, LETTER_PX, np.array(picture.shape[1::-1]) - LETTER_PX)
        letter = tuple(map(int, np.round(inside + LETTER_PX * np.array([-0.5, 0.5]))))
        font, size = cv2.FONT_HERSHEY_SIMPLEX, LETTER_PX / 20
        for line, ink, extra_px in ((DARK, DARK, 2), (rgb, LIGHT, 0)):
            cv2.line(picture, start, tuple(map(int, end)), line, 3 + extra_px, cv2.LINE_AA)
            cv2.putText(picture, name, letter, font, size, ink, 2 + 2 * extra_px, cv2.LINE_AA)
    cv2.circle(picture, start, 4, (255, 255, 255), -1, cv2.LINE_AA)


def _shade(axes: Axes, times: np.ndarray, found: Sequence[PoseEstimate]) -> None:
    """Mark where there is no pose, and where there is one with a warning; the legend says which."""
    if len(times) < 2:
        return
    half = float(np.median(np.diff(times))) / 2
    looks: dict[str, dict[str, Any]] = {
        "lost": {"color": FAINT},
        "with a warning": {"fc": "none", "ec": SOFT, "hatch": "////", "alpha": 0.5},
    }
    for word, look in looks.items():
        lost = word == "lost"
        marked = [x.state == "lost" if lost else x.state in ("weak", "frozen") for x in found]
        edges = np.flatnonzero(np.diff([0, *marked, 0])).reshape(-1, 2)
        for number, (begin, end) in enumerate(edges):
            label = word if number == 0 else None
            span = times[begin] - half, times[end - 1] + half
            axes.axvspan(*span, lw=0, label=label, **look)


@styled
def roll_figure(
    true_deg: Sequence[float], error_deg: Mapping[str, Sequence[float]], title: str
) -> Figure:
    """Error of each tracker against the angle that the object has rolled."""
    figure = card(FULL_IN / 2, 3.0)
    axes = figure.add_subplot()
    looks = zip((BLUE, ORANGE, GREEN, RED), DASHES, strict=True)
    for (name, values), (color, dashes) in zip(error_deg.items(), looks, strict=False):
        axes.plot(true_deg, values, color=color, ls=dashes, label=name)
    axes.set(xlabel="rolled [°]", ylabel="error [°]", title=title, yscale="log")
    name_decades(axes.yaxis)
    axes.grid()
    axes.legend()
    return figure
