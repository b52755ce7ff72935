# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The losses of a training, kept beside its weights as a table and as a picture."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from sensor.files import check_outputs, write_atomic


def refuse_weights(path: Path) -> None:
    """Refuse weights that could not be written, or whose loss could not be, before the hours.

    Raises:
        WedgeError: names the file that is in the way.
    """
    check_outputs(path, *_curve_files(path))


def _curve_files(path: Path) -> tuple[Path, Path]:
    return path.with_suffix(".csv"), path.with_suffix(".png")


def write_curve(path: Path, losses: Sequence[float]) -> None:
    """The loss of every step as ``path``.csv, and its running mean as ``path``.png.

    Raises:
        WedgeError: they cannot be written.
    """
    table, figure = _curve_files(path)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [("step", "loss"), *((step, f"{loss:.6f}") for step, loss in enumerate(losses, start=1))]
    )
    write_atomic(table, text.getvalue().encode())
    width = max(1, len(losses) // 50)
    mean = np.convolve(losses, np.full(width, 1 / width), mode="valid")
    left, top, right, bottom = 90, 40, 780, 400
    along = np.linspace(left, right, len(mean))
    down = bottom - (bottom - top) * mean / mean.max()
    canvas = np.full((450, 800, 3), 255, np.uint8)
    ink, blue = (36, 31, 27), (178, 114, 0)
    cv2.rectangle(canvas, (left, top), (right, bottom), ink)
    cv2.polylines(canvas, [np.stack([along, down], -1).astype(np.int32)], False, blue, 2)
    for words, place in [
        (f"{path.stem}: loss, mean of {width} steps", (left, top - 14)),
        (f"{mean.max():.4f}", (10, top + 12)),
        ("0", (60, bottom)),
        (f"step {width}", (left, bottom + 28)),
        (f"step {len(losses)}", (right - 120, bottom + 28)),
    ]:
        cv2.putText(canvas, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, ink, 1, cv2.LINE_AA)
    write_atomic(figure, cv2.imencode(".png", canvas)[1].tobytes())
