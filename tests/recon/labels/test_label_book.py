# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is written of the same labels is the same, byte for byte: a unit keeps its set's hash."""

import random
from dataclasses import replace
from pathlib import Path

import pytest

from recon.labels.label_book import NO_BALL_FILE, LabelBook, doubtful_first, pressed_frames
from sensor.dataset import LABELS_FILE, BallLabel
from tests.synthetic import make_dataset

NAMES = ("press1.jpg", "press1.png", "press01.png", "press001.png", "press02.png", "press10.png")
PLACE = {"center_x_px": 60.0, "center_y_px": 45.0, "contact_radius_px": 9.0}


@pytest.mark.parametrize("seed", range(8))
def test_files_do_not_depend_on_the_order_of_what_was_found(tmp_path: Path, seed: int) -> None:
    labels = [BallLabel(file=name, **PLACE, quality=0.5) for name in NAMES]
    shuffled = random.Random(seed).sample(labels, len(labels))
    written = []
    for folder, found in ((tmp_path / "one", labels), (tmp_path / "other", shuffled)):
        dataset = make_dataset(folder, presses=0)
        book = LabelBook(replace(dataset, labels=()))
        book.put_found(found)
        by_doubt = doubtful_first([label.file for label in found], book)
        table = (folder / LABELS_FILE).read_bytes()
        for label in found:
            book.remove(label.file)
        written.append((table, (folder / NO_BALL_FILE).read_bytes(), by_doubt))
    assert written[0] == written[1]


def test_frames_come_in_the_order_of_their_numbers_and_a_mac_s_notes_do_not(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=0)
    for name in ("press10.png", "press2.png", "._press2.png"):
        (dataset.folder / name).touch()
    assert pressed_frames(dataset.folder, dataset.card) == ["press2.png", "press10.png"]
