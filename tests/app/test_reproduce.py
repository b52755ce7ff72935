# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge reproduce` on a synthetic set: what it writes, twice, and what it refuses to touch."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from app import reproduce
from app._fabricate import MissingExtraError
from app._reproduce_touch import left_out, touch_sections
from recon.pipeline import Reconstructor
from sensor.design import Wedge
from sensor.errors import WedgeError
from sensor.files import new_folder
from tests.synthetic import make_dataset, make_fabrication
from validation import datasets
from validation.report.page import Section


def import_synthetic(source: Path, folder: Path) -> None:
    make_dataset(folder, presses=6)


def fabricate_quickly(wanted: Wedge, folder: Path, *, again: bool) -> dict[str, Any]:
    """Stands for the command, whose own tests are elsewhere: the least that the page shows."""
    assert again
    with new_folder(folder, over="manifest.json") as draft:
        return make_fabrication(draft, wanted.name, failed=0)


@pytest.fixture
def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One set that is here, one that is not; the quick estimator; no processes."""
    source = tmp_path / "source.txt"
    source.write_text("a seed")

    def dataset(name: str, found: Path | None) -> datasets.KnownDataset:
        return datasets.KnownDataset(
            name=name,
            summary="an ideal sensor",
            presses=6,
            ball_radius_mm=4.0,
            mm_per_px=(0.1, 0.1),
            licence="CC-BY-4.0",
            origin="the tests",
            find=lambda: found,
            sought="make one",
            importer=import_synthetic,
        )

    sets = (dataset("here", source), dataset("elsewhere", None))
    monkeypatch.setattr(datasets, "DATASETS", sets)
    monkeypatch.setattr(reproduce, "NAMES", ("here", "elsewhere"))
    monkeypatch.setattr(reproduce, "ESTIMATORS", ("table",))
    monkeypatch.setattr(reproduce, "SIDE_BY_SIDE", ("here",))
    monkeypatch.setattr(reproduce, "fabricate", fabricate_quickly)
    monkeypatch.setattr(reproduce, "_tracking", lambda: Section(title="Pose tracking", html=""))
    monkeypatch.setattr(reproduce, "process_pool", lambda: ThreadPoolExecutor(1))
    monkeypatch.setenv("WEDGE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "build"


@pytest.fixture
def few_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sections without pictures in the place of most; the rest of the page is as it is."""

    def plain(*_: object) -> Section:
        return Section(title="A set", html="")

    for name in ("results.dataset_section", "side_by_side.side_by_side_section"):
        monkeypatch.setattr(f"validation.report.{name}", plain)
    monkeypatch.setattr(reproduce, "beside_each_other", lambda *_: [])
    monkeypatch.setattr(reproduce, "touch_sections", lambda *_: [])
    monkeypatch.setattr(reproduce, "_integrators", lambda: plain())


def test_writes_page_table_and_unit_and_again(
    known: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reproduce.main(known, folds=2) == 0
    table = (known / "error_table.json").read_bytes()
    (document,) = json.loads(table)["tables"]
    assert {row["estimator"] for row in document["rows"]} == {"table"}
    assert len(document["dataset_sha256"]) == 64
    unit = Reconstructor.load(known / "units" / "here").calibration.card
    assert unit.metrics["fitted_presses"] == unit.metrics["held_out_presses"] == 6
    printed = capsys.readouterr()
    assert str(known / "index.html") in printed.out
    assert "elsewhere: make one" in printed.err
    page = (known / "index.html").read_bytes()
    assert b"Estimators side by side" in page

    reproduce.main(known, folds=2)
    assert (known / "error_table.json").read_bytes() == table
    assert (known / "index.html").read_bytes() == page
    names = {"index.html", "error_table.json", "units", "fabrication"}
    assert {path.name for path in known.iterdir()} == names
    assert {path.name for path in (known / "fabrication").iterdir()} == {"standard", "finger"}
    for design in ("standard", "finger"):
        assert f'href="fabrication/{design}/index.html"' in page.decode()


def test_without_the_solid_modeller_the_page_says_so(
    known: Path,
    few_figures: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise MissingExtraError("fabricate needs cadquery: install the extra cad.")

    monkeypatch.setattr(reproduce, "fabricate", fail)
    assert reproduce.main(known, folds=2) == 0
    sentence = "fabricate needs cadquery: install the extra cad."
    assert sentence in (known / "index.html").read_text(encoding="utf-8")
    assert sentence in capsys.readouterr().err


def test_a_failed_check_of_the_files_fails_the_command(
    known: Path, few_figures: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fabricate(wanted: Wedge, folder: Path, *, again: bool) -> dict[str, Any]:
        with new_folder(folder) as draft:
            return make_fabrication(draft, wanted.name, failed=1)

    monkeypatch.setattr(reproduce, "fabricate", fabricate)
    assert reproduce.main(known, folds=2) == 1
    assert "standard, wall of part 1" in (known / "index.html").read_text(encoding="utf-8")


def test_a_folder_that_is_no_fabrication_is_not_replaced(known: Path) -> None:
    with new_folder(known / "fabrication" / "finger") as folder:
        (folder / "thesis.tex").write_text("years")
    with pytest.raises(WedgeError, match="not empty"):
        reproduce.main(known, folds=2)
    assert not (known / "fabrication" / "standard").exists()
    assert (known / "fabrication" / "finger" / "thesis.tex").read_text() == "years"


def test_a_failure_leaves_the_page_of_before(
    known: Path, few_figures: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    known.mkdir()
    (known / "index.html").write_text("before")

    def fail() -> None:
        raise WedgeError("the disk went away.")

    monkeypatch.setattr(reproduce, "_integrators", fail)
    with pytest.raises(WedgeError, match="went away"):
        reproduce.main(known, folds=2)
    assert (known / "index.html").read_text() == "before"


def test_a_unit_stays_until_the_next_is_whole(
    known: Path, few_figures: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    reproduce.main(known, folds=2)
    unit = known / "units" / "here"
    before = {path.name: path.read_bytes() for path in unit.iterdir()}

    def stop(*_: object) -> None:
        assert {path.name: path.read_bytes() for path in unit.iterdir()} == before
        raise KeyboardInterrupt

    monkeypatch.setattr("recon.calibration.write_image", stop)
    with pytest.raises(KeyboardInterrupt):
        reproduce.main(known, folds=2, seed=1)
    assert {path.name: path.read_bytes() for path in unit.iterdir()} == before
    assert list(unit.parent.iterdir()) == [unit]


def test_a_folder_that_is_no_unit_is_not_replaced(known: Path) -> None:
    with new_folder(known / "units" / "here") as folder:
        (folder / "thesis.tex").write_text("years")
    with pytest.raises(WedgeError, match="not empty"):
        reproduce.main(known, folds=2)
    assert (known / "units" / "here" / "thesis.tex").read_text() == "years"


@pytest.mark.parametrize(
    ("folds", "said"), [(9, "cannot be split by press into 9 folds"), (0, "--folds 0")]
)
def test_folds_that_cannot_be_are_refused_before_anything_is_replaced(
    known: Path, folds: int, said: str
) -> None:
    with pytest.raises(WedgeError, match=said):
        reproduce.main(known, folds=folds)
    assert not known.exists()


@pytest.mark.parametrize("present", [[], ["wedge-lab"], ["marker-balls", "wedge-mit"]])
def test_the_page_says_which_folders_its_dots_and_forces_lack(
    present: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WEDGE_DATA", str(tmp_path))
    for name in present:
        for unit in ("unit-a", "unit-b"):  # so does marker-balls divide
            (tmp_path / name / unit).mkdir(parents=True)
    told = left_out(datasets.known_datasets())
    needed = {"wedge-lab": "a real gel", "marker-balls": "other marker", "wedge-mit": "force"}
    lacking = {name: what for name, what in needed.items() if name not in present}
    assert len(told) == len(lacking)
    for name, what in lacking.items():
        (line,) = (line for line in told if f"put {name}/ into" in line)
        assert what in line


def test_on_a_machine_without_shared_sets_the_section_on_contact_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WEDGE_DATA", str(tmp_path))
    with ThreadPoolExecutor(1) as executor:
        (section,) = touch_sections([], "default", None, executor)
    assert section.html.count("Not shown") == 3
