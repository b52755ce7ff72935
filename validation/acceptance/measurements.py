# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured of a unit: its errors on balls, its lights, its gel, its camera's place."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import fmean

import cv2
import numpy as np

from recon.arrays import ContactMask, Difference, Unwarped
from recon.ball import offsets_mm
from recon.calibration import Calibration
from recon.pixels import BallPress, label_pixels
from recon.presses import PressSet, read_presses
from sensor.dataset import Dataset
from validation.error_table import ErrorTable
from validation.evaluation import evaluate_unit

GREY_LEVELS = 255
FLAT_FROM = 3.0
"""Contact radii: beyond, the gel is untouched."""
SMOOTHING_PX = 3.0
LIT = 0.06
"""Of full scale: the brightest colour of a lit pixel."""
SATURATED = 254 / 255
WORN = 0.1
"""Of full scale: a blank gel's pixel that differs from its surroundings by this is no gel."""
SURROUNDINGS_PX = 9
REACH = 1.5
"""Contact radii round a press for which it teaches."""
MARGIN = 0.04
"""Of the frame: its edge is no gel on every sensor."""


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """All that a certificate says."""

    values: Mapping[str, float]
    """By the names of ``limits.LIMITS``; what could not be measured is absent."""
    absent: Mapping[str, str]
    """Why a measurement was not made."""
    errors: ErrorTable
    held_out: bool
    """Whether the errors are those of presses that the unit has not learnt from."""
    blank: Unwarped
    evenness: Unwarped
    """The blank gel, smoothed."""
    covered: ContactMask


def accept_unit(
    calibration: Calibration,
    dataset: Dataset,
    *,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> Acceptance:
    """Measure a unit on a dataset of its presses.

    On the presses that it was calibrated with, the gradient and depth errors are those that
    calibration measured on presses held out.

    Raises:
        WedgeError: the dataset cannot be used, or comes from another sensor.
    """
    card = calibration.card
    errors = evaluate_unit(
        calibration, dataset, seed=seed, progress=lambda share: progress(0.8 * share)
    )
    presses = read_presses(dataset, lambda share: progress(0.8 + 0.1 * share))
    held_out = dataset.sha256 != card.dataset_sha256
    blank = presses.unwarp(presses.background)
    covered = covered_area(presses.presses)
    values = {
        **error_values(errors, card.metrics, held_out),
        **stillness(presses.presses),
        **color_values(blank, presses),
        "covered_share": float(covered[inner(covered.shape)].mean()),
        "moved_px": shift_px(calibration.unwarp(calibration.background), blank),
    }
    absent = {"frame_rate": "a dataset's frames have no times; `wedge stream` measures rates"}
    turned = lights_turned_deg(card.lights_deg, presses.presses)
    if turned is None:
        absent["lights_turned_deg"] = "the unit does not say where its lights sit"
    else:
        values["lights_turned_deg"] = turned
    progress(1.0)
    return Acceptance(
        values=values,
        absent=absent,
        errors=errors,
        held_out=held_out,
        blank=blank,
        evenness=smooth(blank, SMOOTHING_PX),
        covered=covered,
    )


def error_values(
    errors: ErrorTable, metrics: Mapping[str, int | float], held_out: bool
) -> dict[str, float]:
    """Errors of slope and depth on presses that the unit has not learnt from."""
    (row,) = [row for row in errors.rows if row.pixels == "contact"]
    (depth,) = errors.depth.values()
    deepest = max(fmean(error.peak_truth_mm for error in depth), 1e-6)
    if held_out:
        values = {key: row.errors.values[key] for key in ("theta_x_deg", "theta_y_deg")}
        return {**values, "depth_rmse_share": fmean(e.rmse_mm for e in depth) / deepest}
    return {
        "theta_x_deg": float(metrics.get("contact_theta_x_deg", np.nan)),
        "theta_y_deg": float(metrics.get("contact_theta_y_deg", np.nan)),
        "depth_rmse_share": float(metrics.get("depth_rmse_mm", np.nan)) / deepest,
    }


def stillness(presses: tuple[BallPress, ...]) -> dict[str, float]:
    """Noise and drift of the gel that no press reaches, in grey levels of 255."""
    noise, drift = [], []
    for press in presses:
        x_mm, y_mm = offsets_mm(press.size_px, press.center_px, press.mm_per_px)
        flat = np.hypot(x_mm, y_mm) > FLAT_FROM * press.contact_radius_mm
        if press.hidden is not None:
            flat &= ~press.hidden
        if not flat.any():
            continue
        grain = press.difference - smooth(press.difference, 1.5)
        noise.append(1.4826 * float(np.median(np.abs(grain[flat]))))
        drift.append(float(np.abs(np.median(press.difference[flat], axis=0)).max()))
    if not noise:
        return {}
    return {
        "noise_grey_levels": GREY_LEVELS * fmean(noise),
        "drift_grey_levels": GREY_LEVELS * float(np.quantile(drift, 0.9)),
    }


def color_values(blank: Unwarped, presses: PressSet) -> dict[str, float]:
    """What the lights do: evenness, saturation, balance, area, contrast, cross-talk, wear."""
    gel = blank[inner(blank.shape[:2])]
    even = smooth(gel, SMOOTHING_PX)
    low, high = np.quantile(even.reshape(-1, 3), [0.02, 0.98], axis=0)
    means = even.mean((0, 1))
    contrast, axes_ratio = response(presses.presses)
    surface = cv2.medianBlur(np.ascontiguousarray(gel), 5)
    about = cv2.blur(surface, (4 * SURROUNDINGS_PX, 4 * SURROUNDINGS_PX))
    odd = np.abs(surface - about).max(-1) > WORN
    if presses.dots is not None:
        hidden = presses.dots.hidden(presses.dots.track(blank))
        odd &= ~hidden[inner(blank.shape[:2])]
    bright = np.mean(
        [
            (press.difference + blank)[inner(blank.shape[:2])].max(-1) >= SATURATED
            for press in presses.presses
        ]
    )
    return {
        "least_evenness": float((low / np.maximum(high, 1e-6)).min()),
        "saturated_share": float(bright),
        "color_balance": float(means.min() / max(means.max(), 1e-6)),
        "lit_share": float((even.max(-1) > LIT).mean()),
        "worn_share": float(odd.mean()),
        "least_contrast_grey_levels": GREY_LEVELS * contrast,
        "axes_ratio": axes_ratio,
    }


def response(presses: tuple[BallPress, ...]) -> tuple[float, float]:
    """How colours answer to slope: the weakest colour's contrast, the axes' ratio.

    Contrast is the standard deviation of a colour inside contacts; the ratio is that of the
    singular values of colour against slope, by least squares: 1 where both axes are seen alike.
    """
    parts = [label_pixels(press, index, 0) for index, press in enumerate(presses)]
    color = np.concatenate([part.color[part.contact] for part in parts]).astype(float)
    gradient = np.concatenate([part.gradient[part.contact] for part in parts]).astype(float)
    inside = np.mean([part.color[part.contact].std(0) for part in parts], axis=0)
    terms = np.column_stack([gradient, np.ones(len(gradient))])
    slopes = np.linalg.lstsq(terms, color, rcond=None)[0][:2]
    strong, weak = np.linalg.svd(slopes, compute_uv=False)
    return float(inside.min()), float(strong / max(weak, 1e-9))


def lights_turned_deg(
    lights_deg: Mapping[str, float] | None, presses: tuple[BallPress, ...]
) -> float | None:
    """Largest angle between where a light should be and where its colour says it is."""
    from validation.importers.lights import measure_lights_deg

    if lights_deg is None:
        return None
    measured = measure_lights_deg(presses)
    turns = [abs((measured[c] - angle + 180) % 360 - 180) for c, angle in lights_deg.items()]
    return float(max(turns))


def shift_px(before: Unwarped, now: Unwarped) -> float:
    """How far the blank gel's picture has moved since the calibration."""
    if before.shape != now.shape:
        return float("inf")
    flat = [
        (image.mean(-1) - smooth(image, 6.0).mean(-1)).astype(np.float64) for image in (before, now)
    ]
    window = cv2.createHanningWindow(flat[0].shape[::-1], cv2.CV_64F)
    (x_px, y_px), _ = cv2.phaseCorrelate(flat[0], flat[1], window)
    return float(np.hypot(x_px, y_px))


def covered_area(presses: tuple[BallPress, ...]) -> ContactMask:
    """Where the pad lies near a press."""
    covered = np.zeros(presses[0].difference.shape[:2], bool)
    for press in presses:
        x_mm, y_mm = offsets_mm(press.size_px, press.center_px, press.mm_per_px)
        covered |= np.hypot(x_mm, y_mm) < REACH * press.contact_radius_mm
    return covered


def inner(shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The frame without its margin."""
    rows, columns = (max(1, round(MARGIN * count)) for count in shape[:2])
    return slice(rows, -rows), slice(columns, -columns)


def smooth(image: Difference, sigma_px: float) -> Difference:
    """A Gaussian."""
    return cv2.GaussianBlur(image, (0, 0), sigma_px)
