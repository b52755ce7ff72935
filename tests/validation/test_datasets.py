# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dataset's name leads to one whole folder, made once."""

import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recon.presses import read_presses
from sensor.dataset import BallLabel, DatasetCard, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from validation import datasets
from validation.datasets import DATASETS, KnownDataset, dataset_folder, on_this_machine

NAMES = [known.name for known in DATASETS]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("WEDGE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> KnownDataset:
    """A known set whose source is one small file."""
    source = tmp_path / "toy.txt"
    source.write_text("12")

    def importer(found: Path, folder: Path) -> None:
        write_labels(folder / "labels.csv", [a_label(float(found.read_text()))])
        write_card(folder / "dataset.toml", a_card())

    known = replace(
        DATASETS[0],
        name="toy",
        find=lambda: source if source.is_file() else None,
        sought=f"put it at {source}",
        importer=importer,
    )
    monkeypatch.setattr(datasets, "DATASETS", (*DATASETS, known))
    return known


def a_label(x: float) -> BallLabel:
    return BallLabel(file="0.png", center_x_px=x, center_y_px=5.0, contact_radius_px=4.0)


def a_card() -> DatasetCard:
    return DatasetCard(
        name="toy",
        source="tests",
        licence="CC-BY-4.0",
        mm_per_px=(0.1, 0.1),
        ball_radius_mm=2.0,
        background=("background.png",),
    )


def test_a_folder_is_used_as_it_is(tmp_path: Path) -> None:
    write_card(tmp_path / "mine" / "dataset.toml", a_card())
    assert dataset_folder(tmp_path / "mine") == tmp_path / "mine"
    assert dataset_folder(str(tmp_path / "mine")) == tmp_path / "mine"


def test_a_name_is_imported_once(toy: KnownDataset, own_cache: Path) -> None:
    folder = dataset_folder("toy")
    assert read_dataset(folder).labels[0].center_x_px == 12
    (folder / "labels.csv").write_text("touched")  # a second import would mend this
    assert dataset_folder("toy") == folder
    assert (folder / "labels.csv").read_text() == "touched"
    assert list(own_cache.iterdir()) == [folder]


def test_a_changed_source_makes_a_new_folder(toy: KnownDataset) -> None:
    before = dataset_folder("toy")
    source = toy.find()
    assert source is not None
    source.write_text("13")
    after = dataset_folder("toy")
    assert before != after
    assert read_dataset(after).labels[0].center_x_px == 13


def test_two_at_once_share_one_whole_folder(toy: KnownDataset, own_cache: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        folders = set(pool.map(dataset_folder, ["toy"] * 32))
    assert list(own_cache.iterdir()) == list(folders)
    assert len(read_dataset(folders.pop()).labels) == 1


def test_a_failed_import_leaves_nothing(
    toy: KnownDataset, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(found: Path, folder: Path) -> None:
        write_card(folder / "dataset.toml", a_card())
        raise WedgeError("the source is damaged.")

    monkeypatch.setattr(datasets, "DATASETS", (replace(toy, importer=broken),))
    with pytest.raises(WedgeError, match="damaged"):
        dataset_folder("toy")
    assert list(own_cache.iterdir()) == []


def test_an_absent_source_says_where_it_is_looked_for(toy: KnownDataset) -> None:
    source = toy.find()
    assert source is not None
    source.unlink()
    with pytest.raises(WedgeError, match=r"toy is not on this machine: put it at .*toy\.txt"):
        dataset_folder("toy")


def test_of_known_sets_those_that_are_here_are_taken_and_the_others_told(
    toy: KnownDataset, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = replace(toy, name="gone", find=lambda: None)
    monkeypatch.setattr(datasets, "DATASETS", (toy, gone))
    assert on_this_machine(["gone", "toy"]) == ["toy"]
    assert capsys.readouterr().err == f"left out gone: {gone.sought}\n"
    with pytest.raises(WedgeError, match=r"no dataset is on this machine: put it at .*toy\.txt"):
        on_this_machine(["gone"])


def test_shared_sets_follow_the_variable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WEDGE_DATA", str(tmp_path / "empty"))
    with pytest.raises(WedgeError, match="WEDGE_DATA"):
        dataset_folder("wedge-lab")


def test_an_unknown_name_brings_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(WedgeError, match="did you mean taxim-gelsight"):
        dataset_folder("taxim-gelsigt")
    with pytest.raises(WedgeError, match="wedge data list"):
        dataset_folder("0123456789")
    with pytest.raises(WedgeError, match=r"has no dataset\.toml"):
        dataset_folder(tmp_path)


def test_names_differ_and_every_set_has_its_licence() -> None:
    assert len(set(NAMES)) == len(NAMES)
    assert all(known.licence and known.origin for known in DATASETS)


@pytest.mark.parametrize("known", DATASETS, ids=NAMES)
def test_a_known_set_is_what_the_list_says(known: KnownDataset) -> None:
    if known.find() is None:
        pytest.skip(f"{known.name} is absent: {known.sought}")
    dataset = read_dataset(dataset_folder(known.name))
    assert (dataset.card.name, len(dataset.labels)) == (known.name, known.presses)
    assert dataset.card.mm_per_px == known.mm_per_px
    if known.ball_radius_mm is None:
        assert "placeholder" in dataset.card.source
        assert not dataset.labels
    else:
        assert dataset.card.ball_radius_mm == known.ball_radius_mm
    assert dataset.card.licence == known.licence
    some = dataset.labels[:: max(1, len(dataset.labels) // 4)]
    if some:
        presses = read_presses(replace(dataset, labels=some))
        assert not presses.left_out
        assert dataset.card.lights_deg is not None
        assert set(dataset.card.lights_deg) == {"R", "G", "B"}


def test_taxim_is_on_every_machine_and_its_lights_are_120_degrees_apart() -> None:
    lights = read_dataset(dataset_folder("taxim-gelsight")).card.lights_deg
    assert lights is not None
    gaps = np.diff(np.sort(np.radians(list(lights.values()))))
    assert np.degrees([*gaps, 2 * np.pi - gaps.sum()]) == pytest.approx([120] * 3, abs=10)


def test_a_real_wedge_is_lit_from_its_base_and_both_sides() -> None:
    known = next(known for known in DATASETS if known.name == "wedge-lab")
    if known.find() is None:
        pytest.skip(f"{known.name} is absent: {known.sought}")
    lights = read_dataset(dataset_folder("wedge-lab")).card.lights_deg
    assert lights is not None
    for color, azimuth in {"R": -90.0, "G": 180.0, "B": 90.0}.items():
        assert abs((lights[color] - azimuth + 180) % 360 - 180) < 15


def test_the_card_of_the_documentation_is_lit_as_the_sensor_whose_corners_it_has() -> None:
    known = next(known for known in DATASETS if known.name == "wedge-lab")
    if known.find() is None:
        pytest.skip(f"{known.name} is absent: {known.sought}")
    page = Path(__file__).parents[2] / "docs" / "howto" / "calibrate.md"
    blocks = page.read_text(encoding="utf-8").split("```toml\n")[1:]
    text = next(block.partition("```")[0] for block in blocks if "corners_px" in block)
    card, real = tomllib.loads(text), read_dataset(dataset_folder("wedge-lab")).card
    assert real.corners_px is not None and real.lights_deg is not None
    assert np.array_equal(card["corners_px"], real.corners_px)
    for color, azimuth in real.lights_deg.items():
        assert abs((card["lights_deg"][color] - azimuth + 180) % 360 - 180) < 1
