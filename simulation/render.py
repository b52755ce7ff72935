# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Path-traced radiance of the skin, linear, before any camera."""

import math
from collections.abc import Callable, Iterator
from typing import Final

import cv2
import numpy as np
from jaxtyping import Float32

from sensor.design import Wedge
from sensor.errors import WedgeError
from sensor.extras import how_to_restore
from simulation.engine import Engine
from simulation.scene import Paint, Window, gel_scene
from simulation.skin import Map, View

Radiance = Float32[np.ndarray, "h w 3"]

NARROW_MM: Final = 0.4
"""Half a side of the window in which radiance is taken as linear in the skin's slopes..."""
WIDE_MM: Final = 0.8
"""...and where nothing touches."""
FAINT_MM: Final = 0.02
"""Indentation from which the narrow window holds."""
OUT_OF_MEMORY: Final = "out of memory"
"""In the words of Mitsuba's compiler."""
STEADY_SLOPE: Final = 0.01
"""Slopes that vary less than this in a window do not shape it."""


def drawn_samples(samples: int) -> int:
    """Paths a pixel that are traced for so many: the sampler draws rows and columns of them."""
    columns = math.isqrt(samples)
    return columns * -(-samples // columns)


def render(
    engine: Engine,
    design: Wedge,
    view: View,
    depth_mm: Map,
    *,
    samples: int,
    seed: int,
    window: Window | None = None,
    paint: Paint = "gray",
    ink: Map | None = None,
    threads: int | None = None,
) -> Radiance:
    """What the skin sends toward the camera, per pixel of the gel plane, as traced.

    Args:
        engine: which Mitsuba.
        design: the sensor.
        view: the pixels.
        depth_mm: indentation of the skin.
        samples: paths a pixel, rounded up (``drawn_samples``).
        seed: of the paths; the same seed gives the same picture.
        window: the part of the picture to render; all of it by default.
        paint: on the skin.
        ink: share of light that markers leave.
        threads: that the render may use; all cores by default.

    Raises:
        WedgeError: no samples, Mitsuba or ``smoothed``'s part of OpenCV is not installed, or a
            GPU's memory is too small.
    """
    if samples < 1:
        raise WedgeError(f"--samples {samples} must be at least 1.")
    _refuse_other_opencv()
    columns, all_rows = window or tuple(slice(0, size) for size in view.size_px)

    with engine.loaded(threads) as mi:

        def traced(rows: slice) -> Radiance:
            part = (columns, rows)
            parts = gel_scene(mi, design, view, depth_mm, window=part, paint=paint, ink=ink)
            scene = mi.load_dict(parts, optimize=False)  # merged parts come in a random order
            strip = rows.start - all_rows.start  # each has paths of its own
            return np.array(mi.render(scene, spp=samples, seed=(seed + strip) % 2**32), np.float32)

        return np.concatenate(list(_in_pieces(traced, all_rows)))


def _in_pieces(traced: Callable[[slice], Radiance], rows: slice) -> Iterator[Radiance]:
    """All rows at once, or where a GPU has too little memory for that, in halves of halves."""
    try:
        whole = traced(rows)
    except RuntimeError as error:  # what Mitsuba raises
        if OUT_OF_MEMORY not in str(error):
            raise
        if rows.stop - rows.start < 2:
            raise WedgeError(
                "the GPU's memory is too small for one row of the picture: take fewer --samples."
            ) from error
    else:
        yield whole
        return
    # Not above: the error would hold on to what filled the memory.
    middle = (rows.start + rows.stop) // 2
    yield from _in_pieces(traced, slice(rows.start, middle))
    yield from _in_pieces(traced, slice(middle, rows.stop))


def _refuse_other_opencv() -> None:
    """Refuse an OpenCV without what ``smoothed`` needs, before anything is traced for it."""
    if not hasattr(getattr(cv2, "ximgproc", None), "guidedFilter"):
        raise WedgeError(
            "another OpenCV, as LeRobot brings it, took the place of "
            f"opencv-contrib-python-headless: {how_to_restore('opencv-contrib-python-headless<5')}."
        )


def smoothed(radiance: Radiance, pitch_mm: float, depth_mm: Map, ink: Map | None) -> Radiance:
    """The radiance with most of the tracing's noise removed.

    In a small window, what a matt skin sends is close to linear in its two slopes; a linear fit in
    overlapping windows keeps that and drops the rest (guided filter: He, Sun and Tang, IEEE TPAMI
    35, 2013). The markers' ink is taken off before and put back after.
    """
    slope_y, slope_x = np.gradient(depth_mm, pitch_mm)
    # In units of the regularisation: OpenCV takes covariances below 1e-6 for singular.
    guide = np.ascontiguousarray(np.stack([slope_x, slope_y], -1) / STEADY_SLOPE, np.float32)
    share = np.float32(1) if ink is None else ink[..., None].astype(np.float32)
    narrow, wide = (
        cv2.ximgproc.guidedFilter(guide, radiance / share, round(half / pitch_mm), 1.0)
        for half in (NARROW_MM, WIDE_MM)
    )
    touched = np.clip(depth_mm / FAINT_MM, 0, 1)[..., None].astype(np.float32)
    return (touched * narrow + (1 - touched) * wide) * share
