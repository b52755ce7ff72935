# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How many times as wide as it is a ball's contact looks in raw frames unwarped by four corners.

    python -m benchmarks.magnification standard finger

Computed from the designs by the twin's rays; rendered is only a raw frame of blank gel, in which
corners are found as ``wedge calibrate`` finds them. Four corners are unwarped as if
a pinhole camera saw a plane. The lens is wider than that, a dome's middle lies farther from the
camera than its corners, and what is pressed in lies nearer.

Per place on the pad and depth of the press: radius of the contact in the unwarped frame over its
own, and by how much the cap that a ball of 2.4 mm has over such a circle is higher than its own.
Each once with the scale of the pad's own size, once the same by the corners that are found, which
lie beside the pad's own, once with the scale of a caliper in its middle, and all three again as if
``wedge lens`` had undone all of the lens. Then how far off the corners are that are found, and how
many times as large skin in the middle looks by the pad's own size: at rest, per mm that it lies
deeper, and at rest without the dome, without the lens and without both; and by how much skin at
rest is seen beside its place.
"""

import argparse
import multiprocessing
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float

from benchmarks.caliper import DEPTH_MM, GAP_MM
from recon.geometry.pad import base_side, find_pad, gel_corners
from recon.images import read_image
from sensor.arguments import ending_in_a_sentence
from sensor.design import Wedge
from sensor.design_file import load_design
from sensor.errors import WedgeError
from simulation.dataset import Recipe, write_set
from simulation.engine import best_engine
from simulation.indenters import CALIBRATION_BALL_MM, calibration_ball
from simulation.presses import DEEPEST, Press, ball_presses, contact_circle_px, skin_under
from simulation.raw_view import as_pinhole, pad_corners_px, pixels_of, unwarped_skin
from simulation.skin import Skin, View, gel_view

Points = Float[np.ndarray, "n 2"]

WIDTH_PX: Final = 640
PLACES: Final = ((0.0, 0.0), (-0.5, 0.0), (0.5, 0.0), (0.0, 0.5))
"""Shares of half the pad's length and width, from its middle; negative x is toward the base."""
DEPTHS_MM: Final = (0.3, 0.6, 0.9)
SMALL_MM: Final = 1.0
SAMPLES: Final = 48
GRID: Final = (31, 21)
"""Places along the pad's length and width."""


def without_lens(design: Wedge) -> Wedge:
    """The design with the pinhole that undoing its lens makes of it."""
    return replace(design, camera=replace(design.camera, projection="pinhole"))


def dented(design: Wedge, view: View, x_mm: float, y_mm: float, depth_mm: float) -> Skin:
    """The skin under the calibration ball.

    Raises:
        WedgeError: the press cannot be.
    """
    ball = calibration_ball()
    press = Press(name="ball", indenter=ball, center_mm=(x_mm, y_mm), depth_mm=depth_mm)
    return skin_under(design, view, press)


def times_as_wide(seen: Skin, skin: Skin) -> float:
    """Radius of a round contact as it is seen over its own."""
    (*_, seen_px), (*_, radius_px) = contact_circle_px(seen), contact_circle_px(skin)
    return seen_px / radius_px


def unwarp_by(design: Wedge, corners_px: Points) -> Float[np.ndarray, "3 3"]:
    """From a raw frame to places in mm, by four corners that are taken for the pad's."""
    pad_mm = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * np.array(design.pad_size_mm) / 2
    found: Float[np.ndarray, "3 3"] = cv2.getPerspectiveTransform(
        corners_px.astype(np.float32), pad_mm.astype(np.float32)
    )
    return found


def found_corners_px(design: Wedge) -> Points:
    """The pad's corners as they are found in a rendered raw frame of blank gel, in order (4, 2).

    Raises:
        WedgeError: none are found.
    """
    recipe = Recipe(engine=best_engine(), design=design, samples=SAMPLES, raw=True)
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as made, ProcessPoolExecutor(1, context) as executor:
        folder = Path(made)
        press = ball_presses(design, calibration_ball(), 1, 0)
        write_set(folder, recipe, press, source="blank gel", executor=executor)
        blank = read_image(folder / "background_0.jpg")
    clockwise = find_pad(blank)
    if clockwise is None:
        raise WedgeError(f"no pad is found in a raw frame of {design.name}: give another design.")
    return np.array(gel_corners(clockwise, base_side(clockwise)))


def times_by(design: Wedge, corners_px: Points, own_px: Points, x_mm: float, y_mm: float) -> float:
    """How many times as large a place looks by other corners as by the pad's own."""
    other = unwarp_by(design, corners_px) @ np.linalg.inv(unwarp_by(design, own_px))
    ends = np.array([(x_mm, y_mm), (x_mm + 1e-3, y_mm), (x_mm, y_mm + 1e-3)])
    place, right, below = cv2.perspectiveTransform(ends[:, None], other)[:, 0]
    return float(np.sqrt(np.linalg.det([right - place, below - place]))) / 1e-3


def off_by(design: Wedge, corners_px: Points) -> str:
    """How far found corners lie from the pad's own."""
    off_px = np.hypot(*(corners_px - np.array(pad_corners_px(design))).T)
    return f"{design.name}, corners found: {off_px.min():.1f} to {off_px.max():.1f} px off"


def seen_at_mm(design: Wedge, points_mm: Points, depth_mm: float) -> Points:
    """Where skin is in the unwarped frame that lies so deep below its place at rest (n, 2), in mm.

    It is seen as the surface of gel that is thinner by as much.
    """
    unwarp = unwarp_by(design, np.array(pad_corners_px(design)))
    gel = replace(design.gel, thickness_mm=design.gel.thickness_mm - depth_mm)
    raw_px = pixels_of(replace(design, gel=gel), points_mm)
    seen: Points = cv2.perspectiveTransform(raw_px[:, None], unwarp)[:, 0]
    return seen


def magnification(design: Wedge, depth_mm: float, across_mm: float = SMALL_MM) -> float:
    """How many times as large skin in the middle of the pad looks, so deep below its rest.

    The geometric mean of both axes, as of radii, over a cross of that size.
    """
    half = across_mm / 2
    ends = np.array([(-half, 0.0), (half, 0.0), (0.0, -half), (0.0, half)])
    left, right, above, below = seen_at_mm(design, ends, depth_mm)
    return float(np.sqrt((right - left)[0] * (below - above)[1])) / across_mm


def misplaced_mm(design: Wedge) -> float:
    """By how much skin at rest is seen beside its place, where on the pad that is most."""
    halves = [
        side_mm / 2 * np.linspace(-1, 1, count)
        for side_mm, count in zip(design.pad_size_mm, GRID, strict=True)
    ]
    points = np.stack(np.meshgrid(*halves), -1).reshape(-1, 2)
    return float(np.hypot(*(seen_at_mm(design, points, 0.0) - points).T).max())


def caliper_scale(design: Wedge) -> float:
    """How long a mm of the unwarped frame is by a caliper's edges in the middle of the pad."""
    return 1 / magnification(design, DEPTH_MM, GAP_MM)


def cap_mm(radius_mm: float) -> float:
    """Height of the ball's cap over a circle."""
    return CALIBRATION_BALL_MM - float(np.sqrt(CALIBRATION_BALL_MM**2 - radius_mm**2))


def rows(design: Wedge, view: View, found_px: Points) -> Iterator[str]:
    """A design's presses, a line each; with the corners that are found in its raw frames."""
    own_px, pinhole = np.array(pad_corners_px(design)), without_lens(design)
    found_undone_px, own_undone_px = (as_pinhole(design.camera, px) for px in (found_px, own_px))
    seen_by = (
        (design, found_px, own_px, caliper_scale(design)),
        (pinhole, found_undone_px, own_undone_px, caliper_scale(pinhole)),
    )
    half = np.array(design.pad_size_mm) / 2
    for place in PLACES:
        x_mm, y_mm = (float(mm) for mm in place * half)
        for depth_mm in DEPTHS_MM:
            if depth_mm > DEEPEST * design.gel.thickness_at_mm(x_mm, y_mm):
                continue
            skin = dented(design, view, x_mm, y_mm, depth_mm)
            radius_mm = contact_circle_px(skin)[2] * view.mm_per_px[0]
            told = f"{design.name:10}{f'({x_mm:g}, {y_mm:g})':>14}{depth_mm:>7.1f}{radius_mm:>8.2f}"
            for camera, by_px, beside_px, caliper in seen_by:
                times = times_as_wide(unwarped_skin(camera, view, skin), skin)
                for scale in (1.0, times_by(camera, by_px, beside_px, x_mm, y_mm), caliper):
                    higher = cap_mm(scale * times * radius_mm) / cap_mm(radius_mm) - 1
                    told += f"{scale * times:>9.3f}{higher:>+6.0%}"
            yield told


def middle(design: Wedge) -> str:
    """A design's magnification in the middle of the pad, and what it comes from."""
    rest, deeper = magnification(design, 0.0), magnification(design, DEPTHS_MM[-1])
    flat = replace(design, gel=replace(design.gel, curved=False))
    without = (magnification(one, 0.0) for one in (flat, without_lens(design), without_lens(flat)))
    return (
        f"{design.name}, skin in the middle: {rest:.3f} at rest, "
        f"{(deeper - rest) / DEPTHS_MM[-1]:+.3f} per mm deeper; "
        "flat {:.3f}, lens undone {:.3f}, both {:.3f}; ".format(*without)
        + f"misplaced by up to {misplaced_mm(design):.1f} mm, "
        f"lens undone {misplaced_mm(without_lens(design)):.1f}"
    )


def main() -> None:
    """Compute and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.magnification", description=__doc__)
    parser.add_argument("design", nargs="*", default=["standard", "finger"], help="or a TOML file")
    with ending_in_a_sentence(parser):
        designs = [load_design(name) for name in parser.parse_args().design]
        headings = ("pad's size", "found", "caliper", "lens, pad", "lens, found", "lens, caliper")
        print(
            f"{'design':10}{'place [mm]':>14}{'depth':>7}{'radius':>8}"
            f"{''.join(f'{heading:>15}' for heading in headings)}"
        )
        for design in designs:
            found_px = found_corners_px(design)
            for row in rows(design, gel_view(design, WIDTH_PX), found_px):
                print(row, flush=True)
            print(off_by(design, found_px))
        for design in designs:
            print(middle(design))


if __name__ == "__main__":
    main()
