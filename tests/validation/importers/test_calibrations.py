# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What others' tools write is read back as the same presses; hostile files are refused."""

import subprocess
import sys
import unicodedata
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.__main__ import main
from recon.images import read_frame, read_image, write_image
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from tests.app.commands import run
from tests.synthetic import BALL_RADIUS_MM, MM_PER_PX, make_dataset
from tests.validation.importers.packs import circle, write_taxim
from validation.importers import circle_texts, drawn
from validation.importers.calibrations import find_calibration, import_calibration

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_dataset(tmp_path_factory.mktemp("truth") / "set", presses=5)


def write_gs_sdk(
    truth: Dataset, source: Path, diameters_mm: Sequence[float] = (2 * BALL_RADIUS_MM,) * 5
) -> Path:
    lines = ["experiment_reldir,diameter(mm)"]
    for index, (label, diameter_mm) in enumerate(zip(truth.labels, diameters_mm, strict=True)):
        press = source / f"{diameter_mm:.3f}mm" / str(index)
        write_image(press / "gelsight.png", read_image(truth.folder / label.file))
        x, y, radius = circle(label)
        np.savez(press / "label.npz", center=np.array([x, y]), radius=np.array(radius))
        name = str(press.relative_to(source))
        if index == 1:  # collected on Windows
            name = name.replace("/", "\\")
        lines.append(f"{name},{diameter_mm}")
    waiting = source / "unlabelled"  # their tool goes through the presses one by one
    write_image(waiting / "gelsight.png", read_image(truth.folder / "background.png"))
    lines.append(f"unlabelled,{2 * BALL_RADIUS_MM}")
    write_image(source / "background.png", read_image(truth.folder / "background.png"))
    (source / "catalog.csv").write_text("\n".join(lines) + "\n")
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
    assert [circle(x) for x in found.labels] == [circle(x) for x in truth.labels]
    import_calibration(found, source, folder, mm_per_px=MM_PER_PX[0], ball_radius_mm=BALL_RADIUS_MM)
    read = read_dataset(folder)
    assert all(read.ball_radius_mm(label) == BALL_RADIUS_MM for label in read.labels)
    for label, other in zip(read.labels, truth.labels, strict=True):
        frame = read_frame(folder, label.file)
        np.testing.assert_array_equal(frame, read_image(truth.folder / other.file))
    assert read.card.lights_deg == pytest.approx(truth.card.lights_deg, abs=3)


@pytest.mark.parametrize("here", [".", "below/.."])
def test_a_source_is_called_alike_from_within(
    here: str, truth: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = write_gs_sdk(truth, tmp_path / "my balls")
    (source / "below").mkdir()
    monkeypatch.chdir(source)
    cards = []
    for number, path in enumerate((source, Path(here))):
        found = find_calibration(path)
        assert found is not None
        folder = tmp_path / f"draft-{number}"
        folder.mkdir()
        import_calibration(found, path, folder, mm_per_px=MM_PER_PX[0], ball_radius_mm=None)
        cards.append(read_dataset(folder).card)
    assert (cards[0].name, cards[0].source) == ("my-balls", "gs_sdk catalogue: my balls")
    assert cards[1] == cards[0]


@pytest.mark.parametrize("write", [write_texts, write_one_text])
def test_more_circles_than_can_be_imported_are_refused(
    write, truth: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (drawn, circle_texts):
        monkeypatch.setattr(module, "MOST_PRESSES", len(truth.labels) - 2)
    source = write(truth, tmp_path / "source")
    with pytest.raises(WedgeError, match=f"holds {len(truth.labels)} "):
        find_calibration(source)


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


@pytest.mark.parametrize("diameters_mm", [(8.0, 9.5, 9.5, 12.0, 8.0), (8.0,) * 5, (9.47,) * 5])
def test_each_press_keeps_the_ball_that_made_it(
    diameters_mm: tuple[float, ...], truth: Dataset, tmp_path: Path
) -> None:
    source = write_gs_sdk(truth, tmp_path / "source", diameters_mm)
    found = find_calibration(source)
    assert found is not None
    (tmp_path / "out").mkdir()
    import_calibration(found, source, tmp_path / "out", mm_per_px=MM_PER_PX[0], ball_radius_mm=None)
    read = read_dataset(tmp_path / "out")
    assert [2 * read.ball_radius_mm(label) for label in read.labels] == list(diameters_mm)
    own = {label.ball_radius_mm for label in read.labels}  # where it is not the card's
    assert own - {None} == {x / 2 for x in diameters_mm} - {read.card.ball_radius_mm}
    assert all(label.quality is not None for label in read.labels)


@pytest.mark.parametrize("radius_mm", [2.2, 4.75])
def test_a_ball_that_contradicts_the_catalogue_is_refused(
    radius_mm: float, truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_gs_sdk(truth, tmp_path / "source", (8.0, 9.5, 9.5, 9.5, 9.5))
    words = ["--mm-per-px", f"{MM_PER_PX[0]}", "--ball-radius-mm", f"{radius_mm}"]
    assert run("data", "import", source, "--out", tmp_path / "out", *words) == 2
    said = capsys.readouterr().err
    assert f"{source} states a ball of radius 4 mm" in said
    assert f"--ball-radius-mm {radius_mm:g} contradicts" in said
    assert [path.name for path in tmp_path.iterdir()] == ["source"]


@pytest.mark.parametrize(
    ("write", "ball_radius_mm", "doubt"),
    [
        (write_one_text, BALL_RADIUS_MM, "are --mm-per-px and --ball-radius-mm right"),
        (write_gs_sdk, None, "is --mm-per-px right"),
    ],
)
def test_a_pitch_by_which_circles_are_wider_than_their_ball_is_refused_by_its_option(
    write, ball_radius_mm, doubt, truth: Dataset, tmp_path: Path
) -> None:
    source = write(truth, tmp_path / "pack")
    found = find_calibration(source)
    assert found is not None
    with pytest.raises(WedgeError, match="at 100 mm/px") as refused:
        import_calibration(
            found, source, tmp_path / "set", mm_per_px=100.0, ball_radius_mm=ball_radius_mm
        )
    assert doubt in str(refused.value) and "labels.csv" not in str(refused.value)
    assert not (tmp_path / "set").exists()


def test_a_circle_drawn_wider_than_its_ball_costs_no_other_press(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_gs_sdk(truth, tmp_path / "source")
    drawn = source / f"{2 * BALL_RADIUS_MM:.3f}mm" / "2" / "label.npz"
    x, y, _ = circle(truth.labels[2])
    wide_px = 1.02 * BALL_RADIUS_MM / MM_PER_PX[0]
    np.savez(drawn, center=np.array([x, y]), radius=np.array(wide_px))
    words = ["--mm-per-px", f"{MM_PER_PX[0]}"]
    assert run("data", "import", source, "--out", tmp_path / "out", *words) == 0
    read = read_dataset(tmp_path / "out")
    assert len(read.labels) == len(truth.labels)
    assert read.labels[2].contact_radius_px * MM_PER_PX[0] < BALL_RADIUS_MM
    assert "1 are doubtful" in capsys.readouterr().out


def test_circle_texts_without_a_pitch_leave_the_frames_as_ones_own(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_texts(truth, tmp_path / "source")
    assert run("data", "import", source, "--out", tmp_path / "out") == 2
    said = capsys.readouterr()
    assert "in text files are ignored" in said.out
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


@pytest.mark.parametrize(
    "line",
    [
        "../../etc,8.0",
        "/etc,8.0",
        ",8.0",
        "8.000mm/0,wide",
        "8.000mm/0,-1",
        "8.000mm/0",
        "8.000mm/0\0,8.0",
        pytest.param(f"{'8' * 200_000},8.0", id="a cell longer than csv takes"),
    ],
)
def test_catalogues_that_lead_astray_are_refused(line: str, truth: Dataset, tmp_path: Path) -> None:
    source = write_gs_sdk(truth, tmp_path / "source")
    (source / "catalog.csv").write_text(f"experiment_reldir,diameter(mm)\n{line}\n")
    with pytest.raises(WedgeError, match=r"catalog\.csv"):
        find_calibration(source)


def test_a_link_to_itself_is_no_press(truth: Dataset, tmp_path: Path) -> None:
    source = write_gs_sdk(truth, tmp_path / "source")
    (source / "loop").symlink_to("loop")
    (source / "catalog.csv").write_text("experiment_reldir,diameter(mm)\nloop,8.0\n")
    with pytest.raises(WedgeError, match="source"):
        find_calibration(source)


def test_names_differ_by_case_and_folders_and_numbers_by_what_sets_them_apart(
    truth: Dataset, tmp_path: Path
) -> None:
    source, expected = tmp_path / "source", {}
    lines = ["\ufefffile;x;y;r", "# press00.PNG 1 2 3"]
    for label, file, line in zip(
        truth.labels,
        ("press00.PNG", "Press 01.png", "frames/prêss02.png", "press03.JPEG", "press04.JPG"),
        (
            "PRESS00.png {} {} {} % by eye",
            "C:\\data\\presses\\press 01.PNG;{};{};{};",
            unicodedata.normalize("NFD", '"./all/frames/prêss02.png",{},{},{}'),
            "press03.jpeg ({}, {}) {}",
            "",
        ),
        strict=True,
    ):
        frame = read_image(truth.folder / label.file)
        (source / file).parent.mkdir(parents=True, exist_ok=True)
        format_name = "JPEG" if "J" in file else "PNG"
        Image.fromarray(frame).save(source / file, format=format_name)
        expected[Path(file).stem] = circle(label)
        numbers = [repr(x) for x in circle(label)]
        if ";" in line:
            numbers = [number.replace(".", ",") for number in numbers]
        if line:
            lines.append(line.format(*numbers))
        else:
            text = source / "texts" / "Press04.TXT"
            text.parent.mkdir()
            text.write_text("\t".join(numbers))
    (source / "circles.txt").write_text("\r\n".join(lines), encoding="utf-8", newline="")
    (source / "._circles.txt").write_bytes(b"\xff a Mac's notes")
    write_image(source / "BG-0.png", read_image(truth.folder / "background.png"))
    found = find_calibration(source)
    assert found is not None
    assert {Path(x.file).stem: circle(x) for x in found.labels} == expected
    assert found.left_aside is None


@pytest.mark.parametrize("endless", ["1e999", "inf", "nan"])
def test_what_fits_no_picture_or_is_no_circle_is_said(
    endless: str, truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_one_text(truth, tmp_path / "source")
    text = source / "calib_res.txt"
    _, *others = text.read_text().splitlines()
    unread = ["press00.png 45,5 40,2 12,1", "press99.png 45 40 12", "press00.bmp 45 40 12"]
    unread += ["press00.png 45 40 -12", f"press00.png 45 40 {endless}"]
    text.write_text("\n".join([*unread, *others]))
    words = ["--mm-per-px", f"{MM_PER_PX[0]}", "--ball-radius-mm", f"{BALL_RADIUS_MM}"]
    assert run("data", "import", source, "--out", tmp_path / "out", *words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert len(read_dataset(tmp_path / "out").labels) == len(others)
    for number, line in enumerate(unread, start=1):
        assert f"calib_res.txt, line {number} ({line})" in said
    assert said.count("1 picture without a circle: press00.png") == 1

    text.write_text("\n".join(unread))
    with pytest.raises(SystemExit):
        main(["data", "import", str(source), "--out", str(tmp_path / "none"), *words[:2]])
    said = " ".join(capsys.readouterr().out.split())
    assert "the pictures are searched" in said and "press99.png" in said


def test_presses_that_are_left_out_have_their_own_reasons(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_texts(truth, tmp_path / "source")
    first, again, blank, *others = (label.file for label in truth.labels)
    write_image(source / again, read_image(source / first))
    write_image(source / blank, read_image(source / "bg-0.png"))
    words = ["--mm-per-px", f"{MM_PER_PX[0]}", "--ball-radius-mm", f"{BALL_RADIUS_MM}"]
    assert run("data", "import", source, "--out", tmp_path / "out", *words) == 0
    assert [x.file for x in read_dataset(tmp_path / "out").labels] == [first, *others]
    said = capsys.readouterr().err.splitlines()
    assert said[-3:] == [
        "left out 2 presses:",
        f"  {again}: it is the same picture as {first}",
        f"  {blank}: no contact is visible inside the labelled circle",
    ]


@pytest.mark.parametrize("line", ["bg-0.txt", "all.txt"])
def test_a_circle_on_the_blank_gel_is_no_press(line: str, truth: Dataset, tmp_path: Path) -> None:
    source = write_texts(truth, tmp_path / "source")
    (source / line).write_text("45 40 12" if line == "bg-0.txt" else "bg-0.png 45 40 12")
    found = find_calibration(source)
    assert found is not None and found.left_aside is not None
    assert {x.file for x in found.labels} == {x.file for x in truth.labels}
    assert [path.name for path in found.backgrounds] == ["bg-0.png"]
    assert f"without a circle for a picture of a press in the folder: {line}" in found.left_aside


def test_another_circle_on_one_picture_is_refused(truth: Dataset, tmp_path: Path) -> None:
    source = write_texts(truth, tmp_path / "source")
    stem = Path(truth.labels[0].file).stem
    text = source / "ball_position" / f"{stem}.txt"
    text.write_text(f"# 1 2 3\n{text.read_text()}{text.read_text()}")
    assert find_calibration(source) is not None
    (source / "later.txt").write_text(f"{stem}.png 50 40 12\n")
    with pytest.raises(WedgeError, match=rf"line \d: {stem}\.png has another circle"):
        find_calibration(source)


@pytest.mark.parametrize("write", [write_texts, write_one_text])
def test_two_pictures_of_one_name_are_refused(write, truth: Dataset, tmp_path: Path) -> None:
    source = write(truth, tmp_path / "source")
    name = Path(truth.labels[0].file)
    Image.open(source / name).save(source / f"{name.stem}.jpg")
    with (source / "more.txt").open("w") as stream:
        stream.write(f"{name.stem}.jpg 50 40 12\n")
    with pytest.raises(
        WedgeError, match=rf"{name.stem}\.jpg and {name.stem}\.png have the same name"
    ):
        find_calibration(source)
    for path in source.rglob("*.txt"):
        path.unlink()
    assert find_calibration(source) is None  # as one's own frames they are two


def test_a_folder_without_circles_is_nobodys_calibration(truth: Dataset, tmp_path: Path) -> None:
    source = write_texts(truth, tmp_path / "source")
    for path in source.glob("*/*.txt"):
        path.write_text("notes of the day\n")
    assert find_calibration(source) is None
