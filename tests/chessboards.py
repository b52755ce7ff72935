# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a tilted chessboard, rendered through a lens that is known."""

import cv2
import numpy as np

from recon.geometry.lens import Lens

TRUE = Lens(
    frame_size_px=(320, 240),
    focal_px=(200.0, 202.0),
    center_px=(162.0, 118.0),
    radial=(-0.2, 0.06, 0.0),
    rms_px=0.1,
)
PATTERN = (8, 6)
TILTS = [(0.4, 0.1), (-0.4, 0.2), (0.1, 0.45), (-0.2, -0.45), (0.3, -0.3), (-0.35, 0.35)]


def straight_lens(frame_size_px: tuple[int, int]) -> Lens:
    """One that bends nothing, its centre in the frame's middle."""
    width, height = frame_size_px
    return Lens(
        frame_size_px=frame_size_px,
        focal_px=(50.0, 50.0),
        center_px=((width - 1) / 2, (height - 1) / 2),
        radial=(0.0, 0.0, 0.0),
        rms_px=0.1,
    )


def board_points(tilt: tuple[float, float], index: int) -> np.ndarray:
    """Ideal pixels of a tilted board's inner corners, spread over the frame."""
    columns, rows = PATTERN
    y, x = np.mgrid[:rows, :columns]
    points = np.stack([x - 3.5, y - 2.5, np.zeros_like(x)], -1).reshape(-1, 3) * 1.0
    turned = points @ cv2.Rodrigues(np.array([*tilt, 0.1 * index]))[0].T
    turned += (1.2 * np.cos(index), 0.6 * np.sin(index), 8.5)
    return turned[:, :2] / turned[:, 2:] * TRUE.focal_px + TRUE.center_px


def rendered(tilt: tuple[float, float], index: int) -> np.ndarray:
    """A picture of that board through the true lens."""
    columns, rows = PATTERN
    y, x = np.mgrid[:rows, :columns]
    grid = np.stack([x, y], -1).reshape(-1, 2).astype(np.float32)
    ideal = board_points(tilt, index).astype(np.float32)
    to_board, _ = cv2.findHomography(ideal, grid)
    fine = 3  # sub-pixels, so that edges are as soft as a camera's
    v, u = (np.mgrid[: 240 * fine, : 320 * fine] - (fine - 1) / 2) / fine
    straight = TRUE.undistort(np.stack([u, v], -1).reshape(-1, 2))
    on_board = cv2.perspectiveTransform(straight[:, None], to_board)[:, 0]
    inside = ((on_board > -1) & (on_board < PATTERN)).all(1)
    black = inside & (np.floor(on_board).sum(1) % 2 == 0)
    gray = np.where(black, 30.0, 220.0).reshape(240, fine, 320, fine).mean((1, 3))
    return np.repeat(gray.round().astype(np.uint8)[..., None], 3, -1)
