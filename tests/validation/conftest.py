# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A sensor that its calibration describes, and one to break."""

import pytest

from sensor.dataset import read_dataset
from tests.validation.sensors import accepted_on, good_set, unit_of


@pytest.fixture(scope="session")
def calibration(tmp_path_factory):
    return unit_of(good_set(tmp_path_factory.mktemp("taught") / "set"))


@pytest.fixture(scope="session")
def today(tmp_path_factory):
    """Frames and labels of another day, to copy and to break."""
    return good_set(tmp_path_factory.mktemp("today") / "set", 1)


@pytest.fixture(scope="session")
def accepted(calibration, today):
    return accepted_on(
        calibration, today, times_ns=[i * 33_000_000 for i in range(30)], indices=range(30)
    )


@pytest.fixture
def broken(today, tmp_path):
    """A copy of today's set."""
    folder = tmp_path / "set"
    folder.mkdir()
    for path in today.folder.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return read_dataset(folder)
