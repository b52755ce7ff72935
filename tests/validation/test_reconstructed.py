# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whoever judges presses judges what a user's frames give, under dots as well."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from recon.estimators import fit_estimator, lesson_of
from recon.estimators.lookup_table import LookupTable
from recon.images import read_frame
from recon.pipeline import Reconstructor
from recon.pixels import label_pixels
from recon.presses import read_presses
from tests.validation.sensors import dotted_set, unit_of
from validation.depth import depth_errors
from validation.drift import evaluate_on
from validation.error_table import error_table, measure_press
from validation.examples import example, held_out
from validation.folds import Fold
from validation.metrics import press_errors
from validation.reconstructed import reconstruct_press, slopes_in, slopes_of
from validation.side_by_side import unseen_slopes
from validation.table_text import table_document


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return dotted_set(tmp_path_factory.mktemp("dotted") / "set", presses=6)


@pytest.fixture(scope="module")
def unit(dataset):
    return unit_of(dataset)


@pytest.fixture(scope="module")
def shown(dataset, unit):
    """What a user sees of every press."""
    reconstruct = Reconstructor(unit)
    return [reconstruct(read_frame(dataset.folder, label.file)) for label in dataset.labels]


def test_depth_is_judged_as_a_user_gets_it(dataset, unit, shown):
    presses = read_presses(dataset)
    assert all(press.hidden is not None and press.hidden.any() for press in presses.presses)
    (judged,) = evaluate_on(unit, dataset, seed=0).errors.depth.values()
    for press, found, errors in zip(presses.presses, shown, judged, strict=True):
        as_seen = depth_errors(found.depth_mm, press, dataset.folder)
        assert errors.rmse_mm == pytest.approx(as_seen.rmse_mm, rel=1e-4)
        pictured = example(unit.estimator, "none", dataset, presses, press).picture
        assert np.allclose(pictured.depth_mm, found.depth_mm, atol=1e-5)


def test_slopes_are_judged_as_a_user_gets_them(dataset, unit, shown):
    fold = Fold(estimator=unit.estimator, test=tuple(range(len(shown))))
    presses = read_presses(dataset).presses
    pixels = [label_pixels(press, index, 0) for index, press in enumerate(presses)]
    as_seen = [slopes_in(a, unit.estimator, b) for a, b in zip(shown, pixels, strict=True)]
    assert np.allclose(held_out(dataset.folder, fold, 0).estimated, np.vstack(as_seen), atol=1e-4)
    contact = [slopes[some.contact] for slopes, some in zip(as_seen, pixels, strict=True)]
    found = unseen_slopes(dataset.folder, fold, 0).estimated
    assert np.allclose(found, np.vstack(contact), atol=1e-4)


def test_a_table_judges_slopes_as_a_user_gets_them(dataset, unit, shown):
    for index, press in enumerate(read_presses(dataset).presses):
        pixels = label_pixels(press, index, 0)
        seen = slopes_in(shown[index], unit.estimator, pixels)
        as_seen = press_errors(press.file, seen, pixels.gradient, np.ones(len(pixels), bool))
        found = measure_press(unit.estimator, press, pixels, "none", None)[0]
        assert np.allclose(found.absolute, as_seen.absolute, rtol=1e-4)


class Reaching(LookupTable):
    """One by whom gel far from what moved is flat."""

    reach = 0.03


@pytest.mark.parametrize("channels, missing", [("RGB", "none"), ("RB", "none"), ("RB", "zero")])
@pytest.mark.parametrize("kind", [LookupTable, Reaching])
def test_slopes_are_judged_as_depth_is_integrated_from_them(dataset, kind, channels, missing):
    presses, lights_deg = read_presses(dataset).presses, dataset.card.lights_deg
    fitted = fit_estimator("table", lesson_of("table", presses, range(3), 0), channels, 0)
    estimator = kind(**vars(fitted))
    for index, press in enumerate(presses[3:]):
        for seen in (press, replace(press, hidden=None)):
            pixels = label_pixels(seen, index, 0)
            found = slopes_of(estimator, seen, pixels, missing, lights_deg)
            whole = reconstruct_press(seen, estimator, missing, lights_deg)
            assert np.array_equal(found, slopes_in(whole, estimator, pixels))


def test_what_stands_under_dots_is_judged_by_nobody(dataset, unit):
    press = read_presses(dataset).presses[0]
    spoilt = replace(press, difference=np.where(press.hidden[..., None], 0.05, press.difference))
    spoilt = replace(spoilt, difference=spoilt.difference.astype(np.float32))
    pixels = label_pixels(press, 0, 0)
    for missing, lights_deg in (("none", None), ("zero", dataset.card.lights_deg)):
        clean, other = (
            measure_press(unit.estimator, one, pixels, missing, lights_deg)
            for one in (press, spoilt)
        )
        for one, two in zip(clean, other, strict=True):
            assert np.array_equal(one.absolute, two.absolute)


def test_a_marker_gel_s_table_does_not_depend_on_what_runs_the_tasks(dataset):
    documents = []
    for workers in (1, 3):
        with ThreadPoolExecutor(workers) as executor:
            table = error_table(dataset.folder, ("table",), folds=2, seed=0, executor=executor)
        documents.append(json.dumps(table_document(table)))
    assert documents[0] == documents[1]
