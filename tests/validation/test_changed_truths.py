# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses that a unit has learnt from with other circles, another ball or another scale."""

import shutil
from dataclasses import replace

import pytest

from recon.calibration import load_calibration
from sensor.dataset import CARD_FILE, LABELS_FILE, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from tests.validation.sensors import PRESSES, accepted_on, good_set, unit_of

MINOR = 3


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    return good_set(tmp_path_factory.mktemp("learnt"))


@pytest.fixture(scope="module")
def unit(learnt, tmp_path_factory):
    folder = tmp_path_factory.mktemp("unit") / "unit"
    unit_of(learnt).save(folder)
    return load_calibration(folder)


def smaller(labels):
    first = [replace(x, contact_radius_px=0.9 * x.contact_radius_px) for x in labels[:MINOR]]
    return [*first, *labels[MINOR:]]


@pytest.mark.parametrize(
    ("change", "count"),
    [
        (lambda card, labels: (card, smaller(labels)), MINOR),
        (
            lambda card, labels: (replace(card, ball_radius_mm=2 * card.ball_radius_mm), labels),
            PRESSES,
        ),
    ],
    ids=["circles", "ball"],
)
def test_the_calibrations_own_errors_are_not_told_of_other_truths(
    unit, learnt, tmp_path, change, count
):
    assert accepted_on(unit, learnt).learnt == PRESSES
    folder = shutil.copytree(learnt.folder, tmp_path / "set")
    card, labels = change(learnt.card, learnt.labels)
    write_card(folder / CARD_FILE, card)
    write_labels(folder / LABELS_FILE, labels)
    with pytest.raises(WedgeError, match=rf" of {count} of these presses, .* calibrate it again"):
        accepted_on(unit, read_dataset(folder))


def test_other_names_and_fewer_presses_are_no_other_truths(unit, learnt, tmp_path):
    folder = shutil.copytree(learnt.folder, tmp_path / "set")
    write_card(folder / CARD_FILE, replace(learnt.card, name="renamed", licence="none"))
    write_labels(folder / LABELS_FILE, learnt.labels[MINOR:])
    assert accepted_on(unit, read_dataset(folder)).learnt == PRESSES - MINOR


def test_presses_of_another_day_may_be_of_another_ball(unit, tmp_path):
    today = good_set(tmp_path / "set", 1)
    larger = replace(today.card, ball_radius_mm=1.2 * today.card.ball_radius_mm)
    assert accepted_on(unit, replace(today, card=larger)).errors is not None
