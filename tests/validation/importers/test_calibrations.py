# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What others' tools write is read back as the same presses; hostile files are refused."""

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from recon.images import read_frame, read_image, write_image
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from tests.synthetic import BALL_RADIUS_MM, MM_PER_PX, make_dataset
from validation.importers.calibrations import find_calibration, import_calibration

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_dataset(tmp_path_factory.mktemp("truth") / "set", presses=5)


def circle(label) -> list[float]:
    return [label.center_x_px, label.center_y_px, label.contact_radius_px]


def write_gs_sdk(truth: Dataset, source: Path) -> Path:
    lines = ["experiment_reldir,diameter(mm)"]
    for index, label in enumerate(truth.labels):
        press = source / f"{2 * BALL_RADIUS_MM:.3f}mm" / str(index)
        write_image(press / "gelsight.png", read_image(truth.folder / label.file))
        x, y, radius = circle(label)
        np.savez(press / "label.npz", center=np.array([x, y]), radius=np.array(radius))
        name = str(press.relative_to(source))
        if index == 1:  # collected on Windows
            name = name.replace("/", "\\")
        lines.append(f"{name},{2 * BALL_RADIUS_MM}")
    waiting = source / "unlabelled"  # their tool goes through the presses one by one
    write_image(waiting / "gelsight.png", read_image(truth.folder / "background.png"))
    lines.append(f"unlabelled,{2 * BALL_RADIUS_MM}")
    write_image(source / "background.png", read_image(truth.folder / "background.png"))
    (source / "catalog.csv").write_text("\n".join(lines) + "\n")
    return source


def write_taxim(truth: Dataset, source: Path) -> Path:
    source.mkdir()
    frames = [read_image(truth.folder / label.file)[..., ::-1] for label in truth.labels]
    np.savez(
        source / "dataPack.npz",
        f0=read_image(truth.folder / "background.png")[..., ::-1],
        imgs=np.stack(frames),
        touch_center=np.array([circle(label)[:2] for label in truth.labels]),
        touch_radius=np.array([circle(label)[2] for label in truth.labels]),
        names=np.array(["a", "b"]),
    )
    return source


def write_texts(truth: Dataset, source: Path) -> Path:
    for label in truth.labels:
        write_image(source / label.file, read_image(truth.folder / label.file))
        x, y, radius = circle(label)
        text = source / "ball_position" / f"{Path(label.file).stem}.txt"
        text.parent.mkdir(exist_ok=True)
        text.write_text(f"{x} {y} {radius}\n")
    write_image(source / "bg-0.png", read_image(truth.folder / "background.png"))
    return source


def write_one_text(truth: Dataset, source: Path) -> Path:
    write_texts(truth, source)
    lines = []
    for label in truth.labels:
        (source / "ball_position" / f"{Path(label.file).stem}.txt").unlink()
        x, y, radius = circle(label)
        lines.append(f"{label.file} ({x}, {y}) {radius}")
    (source / "calib_res.txt").write_text("\n".join(lines))
    return source


WRITERS = pytest.mark.parametrize("write", [write_gs_sdk, write_taxim, write_texts, write_one_text])


@WRITERS
def test_presses_come_back_as_they_were_written(write, truth: Dataset, tmp_path: Path) -> None:
    source = write(truth, tmp_path / "source")
    found = find_calibration(source)
    assert found is not None
    folder = tmp_path / "out"
    folder.mkdir()
    import_calibration(
        found,
        source,
        folder,
        mm_per_px=MM_PER_PX[0],
        ball_radius_mm=BALL_RADIUS_MM,
        mend_circles=False,
    )
    read = read_dataset(folder)
    assert [circle(x) for x in read.labels] == [circle(x) for x in truth.labels]
    assert all(read.ball_radius_mm(label) == BALL_RADIUS_MM for label in read.labels)
    for label, other in zip(read.labels, truth.labels, strict=True):
        frame = read_frame(folder, label.file)
        np.testing.assert_array_equal(frame, read_image(truth.folder / other.file))
    assert read.card.lights_deg == pytest.approx(truth.card.lights_deg, abs=3)


def test_the_command_imports_and_says_what_it_misses(truth: Dataset, tmp_path: Path) -> None:
    source = write_gs_sdk(truth, tmp_path / "source")
    words = [sys.executable, "-P", "-m", "app", "data", "import", str(source)]
    words += ["--out", str(tmp_path / "out")]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--mm-per-px" in done.stderr
    assert not (tmp_path / "out").exists()
    words += ["--mm-per-px", str(MM_PER_PX[0])]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(read_dataset(tmp_path / "out").labels) == len(truth.labels)
    assert f"{len(truth.labels)} labelled presses" in done.stdout
    assert "refitted to the ball's shading" in done.stdout


def test_circle_texts_without_a_pitch_leave_the_frames_as_ones_own(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_texts(truth, tmp_path / "source")
    with pytest.raises(SystemExit) as stop:
        main(["data", "import", str(source), "--out", str(tmp_path / "out")])
    assert stop.value.code == 2
    said = capsys.readouterr()
    assert "left aside" in said.out
    assert "--ball-radius-mm" in said.err


def test_backgrounds_that_disagree_are_named_where_they_lie(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "frames"
    for name, file in (("bg-0", "background.png"), ("bg-1", truth.labels[0].file)):
        write_image(source / f"{name}.png", read_image(truth.folder / file))
    write_image(source / "press.png", read_image(truth.folder / truth.labels[1].file))
    with pytest.raises(SystemExit) as stop:
        words = ["--out", str(tmp_path / "out"), "--ball-radius-mm", f"{BALL_RADIUS_MM}"]
        main(["data", "import", str(source), *words])
    assert stop.value.code == 2
    assert f"{source / 'bg-1.png'} and bg-0.png disagree" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def spoil_pickle(source: Path) -> None:
    np.savez(source / "dataPack.npz", f0=np.array([{}], dtype=object))


def spoil_truncated(source: Path) -> None:
    content = (source / "dataPack.npz").read_bytes()
    (source / "dataPack.npz").write_bytes(content[: len(content) // 2])


def spoil_size(source: Path) -> None:
    """A header that claims more than any machine has."""
    with zipfile.ZipFile(source / "dataPack.npz") as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    header = parts["imgs.npy"]
    parts["imgs.npy"] = header.replace(b"(5, ", b"(9999999999, ", 1)[: len(header)]
    with zipfile.ZipFile(source / "dataPack.npz", "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


def spoil_circle(source: Path) -> None:
    with np.load(source / "dataPack.npz") as pack:
        parts = dict(pack)
    parts["touch_radius"] = np.full(5, np.nan)
    np.savez(source / "dataPack.npz", **parts)


def spoil_shape(source: Path) -> None:
    with np.load(source / "dataPack.npz") as pack:
        parts = dict(pack)
    parts["imgs"] = parts["imgs"][..., 0]
    np.savez(source / "dataPack.npz", **parts)


@pytest.mark.parametrize(
    "spoil", [spoil_pickle, spoil_truncated, spoil_size, spoil_circle, spoil_shape]
)
def test_hostile_packs_are_refused_in_a_sentence(spoil, truth: Dataset, tmp_path: Path) -> None:
    source = write_taxim(truth, tmp_path / "source")
    spoil(source)
    with pytest.raises(WedgeError, match="dataPack"):
        find_calibration(source)


@pytest.mark.parametrize(
    "line",
    ["../../etc,8.0", "/etc,8.0", ",8.0", "8.000mm/0,wide", "8.000mm/0,-1", "8.000mm/0"],
)
def test_catalogues_that_lead_astray_are_refused(line: str, truth: Dataset, tmp_path: Path) -> None:
    source = write_gs_sdk(truth, tmp_path / "source")
    (source / "catalog.csv").write_text(f"experiment_reldir,diameter(mm)\n{line}\n")
    with pytest.raises(WedgeError, match=r"catalog\.csv"):
        find_calibration(source)


def test_a_folder_without_circles_is_nobodys_calibration(truth: Dataset, tmp_path: Path) -> None:
    source = write_texts(truth, tmp_path / "source")
    for path in source.glob("*/*.txt"):
        path.write_text("notes of the day\n")
    assert find_calibration(source) is None
