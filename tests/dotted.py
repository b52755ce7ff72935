# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Gels with dots whose places are known: drawn with soft edges on a shaded pad."""

import numpy as np

WIDTH, HEIGHT = 240, 180


def grid_px(spacing_px=20.0, turn_deg=0.0, bend=0.0, margin_px=12.0, size=(WIDTH, HEIGHT)):
    """Centres of a grid, turned about the frame's middle and bent like a lens bends it."""
    width, height = size
    middle = np.array([width, height]) / 2 + [0.3, -0.2]
    reach = int(np.hypot(width, height) / spacing_px) + 2
    columns, rows = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    offsets = spacing_px * np.stack([columns.ravel(), rows.ravel()], 1)
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    offsets = offsets @ turn.T
    away = np.linalg.norm(offsets, axis=1, keepdims=True) / width
    places = middle + offsets * (1 + bend * away**2)
    inside = (places > margin_px).all(1) & (places < np.array(size) - 1 - margin_px).all(1)
    return places[inside]


def pad(size=(WIDTH, HEIGHT), vignette=0.6):
    """A blank pad of another colour in every corner, darker toward them."""
    width, height = size
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    dark = 1 - vignette * (x**2 + y**2) / 2
    colors = np.stack([0.5 - 0.2 * y, 0.45 - 0.15 * x, 0.5 + 0.2 * y], -1)
    return colors * dark[..., None]


def dotted(places, radius_px=3.0, image=None, noise=0.004, darkness=0.8, seed=0):
    """Dark dots, their edges a pixel wide, on an image (h, w, 3); float32, 0 to 1."""
    image = pad() if image is None else image
    height, width = image.shape[:2]
    rows, columns = np.ogrid[:height, :width]
    shade = np.ones((height, width))
    for x, y in places:
        near = tuple(
            slice(max(int(at - radius_px - 1), 0), max(int(at + radius_px + 2), 0)) for at in (y, x)
        )
        away = np.hypot(columns[:, near[1]] - x, rows[near[0]] - y)
        dot = 1 - darkness * np.clip(radius_px + 0.5 - away, 0, 1)
        shade[near] = np.minimum(shade[near], dot)
    noisy = image * shade[..., None]
    noisy = noisy + noise * np.random.default_rng(seed).standard_normal(image.shape)
    return np.clip(noisy, 0, 1).astype(np.float32)
