# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The folded path, traced whole, shows what the raw view looks up."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from sensor.design import STANDARD
from simulation.engine import SCALAR
from simulation.raw_view import follow, raw_frame
from simulation.render import render, smoothed
from simulation.skin import gel_view
from tests.simulation.folded import trace_folded

PINHOLE = replace(
    STANDARD, camera=replace(STANDARD.camera, projection="pinhole", width_px=96, height_px=72)
)


def test_the_raw_view_is_the_traced_path_but_for_what_the_mirror_returns(mitsuba) -> None:
    view = gel_view(PINHOLE, 48)
    rest = np.zeros(view.size_px[::-1])
    whole = trace_folded(SCALAR, PINHOLE, view, rest, samples=144, seed=0)
    straight = render(SCALAR, PINHOLE, view, rest, samples=256, seed=0)
    looked_up = raw_frame(
        PINHOLE, view, smoothed(straight, view.mm_per_px[0], rest, None), rest, baffle=False
    )
    columns, rows = np.meshgrid(np.arange(96.0), np.arange(72.0))
    seen = follow(PINHOLE, np.stack([columns.ravel(), rows.ravel()], 1), None, None)
    for direct in (False, True):
        pad = (np.isfinite(seen.point_mm[:, 0]) & (seen.direct == direct)).reshape(72, 96)
        pad = ndimage.binary_erosion(pad, iterations=2)
        assert pad.sum() > 400
        ratio = whole[pad].mean(0) / looked_up[pad].mean(0)
        assert (1.0 < ratio).all() and (ratio < 1.35).all()  # the mirror sends light back
    pad = ndimage.binary_erosion(
        (np.isfinite(seen.point_mm[:, 0]) & ~seen.direct).reshape(72, 96), iterations=2
    )
    coarse = [ndimage.uniform_filter(np.where(pad[..., None], f, 0), (5, 5, 0)) for f in
              (whole, looked_up)]  # fmt: skip
    inner = ndimage.binary_erosion(pad, iterations=3)
    for channel in range(3):
        found, expected = (picture[inner][:, channel] for picture in coarse)
        assert np.corrcoef(found, expected)[0, 1] > 0.9
