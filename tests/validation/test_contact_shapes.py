# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Masks over shapes whose contact is known, and the page that shows them."""

import numpy as np

from recon.pipeline import Reconstruction
from validation.contact_shapes import ShapeContact
from validation.figures.contact import contact_figure
from validation.report.contact_shapes import shape_contact_section
from validation.shadows import ShadowScore


def shape(name, found, truth):
    flat = np.zeros(truth.shape)
    touch = Reconstruction(
        difference=np.zeros((*truth.shape, 3), np.float32),
        gradient=np.zeros((*truth.shape, 2)),
        depth_mm=flat,
        disturbed=found,
        boundary="dirichlet",
        mm_per_px=(0.1, 0.1),
    )
    vars(touch)["contact"] = found  # as if asked for before
    shadows = ShadowScore(name=name, found_px=50, right_px=40, cast_px=20, cast_found_px=15)
    return ShapeContact(
        name=name, difference=touch.difference, touch=touch, truth=truth, exact=truth,
        shadows=shadows,
    )  # fmt: skip


def test_the_section_on_shapes_says_how_masks_and_shadows_fit():
    truth = np.zeros((40, 50), bool)
    truth[10:30, 10:30] = True
    half = truth & (np.arange(50) < 20)
    section = shape_contact_section(
        "a-twin", "an-estimator", [shape("m2_screw", half, truth), shape("b", truth, truth)]
    )
    for words in (
        *("a-twin", "by the estimator an-estimator", "M2 screw", "0.500", "1.000"),
        *("Mean IoU 0.750", "0.75"),
        *("0.80", "<img"),
    ):
        assert words in section.html
    shown = [axes.get_title("left") for axes in contact_figure([shape("a", truth, truth)] * 5).axes
             if axes.get_visible()]  # fmt: skip
    assert shown == ["a: 1.00"] * 5
