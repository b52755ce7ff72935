# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture` makes a dataset folder that calibration reads."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from sensor.dataset import read_dataset
from tests.synthetic import make_dataset

ROOT = Path(__file__).resolve().parents[2]


def test_a_folder_of_frames_becomes_a_dataset(tmp_path: Path) -> None:
    like = make_dataset(tmp_path / "like", presses=4)
    frames = tmp_path / "frames"
    frames.mkdir()
    for index, name in enumerate(["background.png", *(x.file for x in like.labels)]):
        (frames / f"{index:02d}.png").write_bytes((like.folder / name).read_bytes())
    (frames / "99.png").write_bytes((like.folder / "background.png").read_bytes())
    out = tmp_path / "out"
    words = ("capture", str(frames), "--like", str(like.folder), "--out", str(out))
    command = [sys.executable, "-P", "-m", "app", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "no contact" in done.stderr
    captured = read_dataset(out)
    assert len(captured.labels) == len(like.labels)
    for label, truth in zip(captured.labels, like.labels, strict=True):
        off = (label.center_x_px - truth.center_x_px, label.center_y_px - truth.center_y_px)
        assert np.hypot(*off) < 1.0
    again = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert again.returncode == 2
    assert len(again.stderr.splitlines()) == 1
