# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page's sections on dots and contact say the numbers they are given."""

import io

import numpy as np
from PIL import Image

from recon.markers.tracking import marker_tracker
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px
from validation.contact import Overlap
from validation.dots import DetectionScore
from validation.figures.markers import displacement_figure
from validation.figures.png import png_bytes
from validation.force import ForceCurve
from validation.report.touch import contact_section, marker_section

PLACES = grid_px(20.0)


def tracked(by_px):
    image = dotted(PLACES + np.array(by_px))
    tracker = marker_tracker(dotted(PLACES))
    return image, tracker.track(image)


def curve(name, order):
    force = np.array([0.0, 5.0, 10.0, 20.0])
    return ForceCurve(name=name, force_n=force, area_mm2=force[order], deepest_mm=force + 1.0)


def test_the_picture_of_dots_keeps_the_frames_shape_and_shows_what_moved():
    pixels = {}
    for by_px in ((0.0, 0.0), (5.0, 2.0)):
        png = png_bytes(displacement_figure(*tracked(by_px), (0.1, 0.1)))
        pixels[by_px] = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)
    height, width = pixels[0.0, 0.0].shape[:2]
    assert abs(width / height - WIDTH / HEIGHT) < 0.05
    white = {by_px: (image == 255).all(-1).mean() for by_px, image in pixels.items()}
    assert white[5.0, 2.0] > white[0.0, 0.0]  # arrows


def test_the_section_on_dots_says_what_was_counted_and_found():
    image, dots = tracked((3.0, 0.0))
    score = DetectionScore(whole=123, found=121, false=4, rms_px=0.57)
    presses = [("press 7", image, dots), ("press 8", image, dots)]
    html = marker_section({"a-gel": score}, "a-gel", presses, (0.1, 0.1)).html
    for words in ("123", "121", "<td>4</td>", "0.57", "press 7 of a-gel", f"of {len(PLACES)} dots"):
        assert words in html
    assert "2 presses on a-gel" in html and html.count("<img") == 2


def test_the_section_on_contact_says_mean_and_least_overlap_and_how_force_goes_along():
    found = [
        Overlap(name="one", iou=0.95, radius_ratio=1.1),
        Overlap(name="two", iou=0.75, radius_ratio=0.9),
    ]
    html = contact_section({"balls": found}, [curve("wedge-mit-x", [0, 1, 3, 2])], []).html
    for words in ("0.850", "0.750", "1.00", "x 0.80 and 1.00"):
        assert words in html
    assert "<img" not in contact_section({"balls": found}, [], []).html
    assert "<li>Not shown</li>" in contact_section({"balls": found}, [], ["Not shown"]).html
