# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Models that several tests measure, built once, and a folder written twice by the command."""

import fcntl
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from bom.bill import make_bill, read_parts
from bom.fit import parts_for
from cad.build import Model, manifest_of, model
from cad.exports.laser import Piece, Vertex, sheets
from cad.guide import part_names
from sensor.design import FINGER, STANDARD, Wedge

ROOT = Path(__file__).resolve().parents[2]


def pieces_by_id(design: Wedge) -> dict[str, Piece]:
    """Every piece of every sheet."""
    return {piece.id: piece for sheet in sheets(design) for piece in sheet.pieces}


def area_mm2(points: Sequence[Vertex]) -> float:
    """Area inside a closed outline with bulges."""
    total = 0.0
    for (x0, y0, bulge), (x1, y1, _) in zip(points, [*points[1:], points[0]], strict=True):
        total += (x0 * y1 - x1 * y0) / 2
        if bulge:
            angle = 4 * math.atan(bulge)
            radius = math.hypot(x1 - x0, y1 - y0) / (2 * math.sin(abs(angle) / 2))
            total += radius**2 / 2 * (angle - math.sin(angle))
    return total


def names_of(built: Model) -> dict[str, str]:
    """What people call each part, by id."""
    manifest = manifest_of(built, [])
    lines = make_bill(manifest["bill"], parts_for(built.design, read_parts()))
    return part_names(manifest["parts"], {line.part.id: line.part.name for line in lines})


@pytest.fixture(scope="session")
def finger() -> Model:
    return model(FINGER)


@pytest.fixture(scope="session")
def standard() -> Model:
    return model(STANDARD)


@pytest.fixture(scope="session")
def fabricated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The finger's folder from two processes that hash text differently.

    Test processes that run beside each other share it: the first one makes it.
    """
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folders = (root / "fabricated" / "first", root / "fabricated" / "second")
    with (root / "fabricated.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not all(folder.exists() for folder in folders):
            _fabricate(folders)
    return folders


def _fabricate(folders: tuple[Path, Path]) -> None:
    runs = [
        subprocess.Popen(
            [sys.executable, "-P", "-m", "app", "fabricate", "--design", "finger", "--out", folder],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": str(seed), "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for seed, folder in enumerate(folders, start=1)
    ]
    said = [run.communicate()[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], "\n".join(said)
