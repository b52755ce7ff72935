# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge simulate` and `wedge sweep` as typed: what they write, what they refuse, on a cluster."""

import io
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

import simulation.engine
from app import simulate, sweep
from app._cluster import cluster_pool
from app._render_refusals import refuse_unbuildable
from sensor.dataset import read_dataset
from sensor.design import FINGER
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from simulation.engine import SCALAR
from tests.app.commands import run
from tests.simulation.conftest import InLine

ROOT = Path(__file__).resolve().parents[2]

pytest.importorskip("mitsuba", reason="the twin renders with mitsuba")


def in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No processes, the plain engine."""

    @contextmanager
    def in_line():
        yield InLine()

    for module in (simulate, sweep):
        monkeypatch.setattr(module, "process_pool", in_line)
    monkeypatch.setattr(simulation.engine, "best_engine", lambda: SCALAR)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """No processes, the plain engine, an empty folder."""
    in_one_process(monkeypatch)
    monkeypatch.chdir(tmp_path)
    return tmp_path


SMALL = ("--design", "finger", "--samples", "4", "--width-px", "24")
FIVE_PRESSES = ("sweep", "lights.lit_sides", "RGB", "R", "G", "--design", "finger",
                "--presses", "5", "--samples", "16", "--width-px", "48")  # fmt: skip


def test_simulate_writes_a_dataset_that_says_how_it_was_made(here, monkeypatch, capsys) -> None:
    words = ["simulate", *SMALL, "--presses", "2", "--out", "d"]
    monkeypatch.setattr("sys.argv", ["wedge", *words])
    assert run(*words) == 0
    dataset = read_dataset(here / "d")
    assert len(dataset.labels) == 2
    assert (
        dataset.card.source
        == "wedge simulate --design finger --samples 4 --width-px 24 --presses 2"
    )
    assert dataset.card.name == "d"  # and not that of the shipped set, whose frames are others
    told = capsys.readouterr().out
    assert "2 labelled presses, 0 shapes with their truth" in told
    assert "wedge table" not in told  # which would refuse contacts of so few pixels
    assert run("simulate", *SMALL, "--scene", "prism", "--out", "sub/e") == 0
    assert read_dataset(here / "sub" / "e").card.name == "e"
    assert "0 labelled presses, 1 shape with its truth" in capsys.readouterr().out
    assert run(*words) == 2  # the folder is not empty now


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--design", "thumb"], "neither a design"),
        (["--scene", "cat"], "no scene 'cat'"),
        (["--scene", "stl"], "or a mesh in mm (.stl, .ply, .obj)."),
        (["--samples", "0"], "--samples 0"),
        (["--width-px", "2"], "--width-px 2"),
        (["--presses", "0"], "--presses 0"),
        (["--scene", "prism", "--presses", "5"], "scene prism has none: leave it out"),
        (["--ball-radius-mm", "30"], "larger than the pad"),
        (["--depth-mm", "-1"], "deeper than zero"),
        (["--depth-mm", "inf"], "finite"),
        (["--scene", "prism", "--depth-mm", "8"], "goes through the gel"),
        (["--depth-mm", "2.9"], "past its middle"),
        (["--paint", "silver", "--view", "raw"], "take --paint gray, or --view gel."),
        (["--no-baffle"], "take --view raw with --no-baffle."),
        (["--scene", "disc_shallow", "--depth-mm", "0.0009"], "disc_shallow: the object does not"),
    ],
)
def test_simulate_refuses_in_a_sentence_and_leaves_nothing(here, words, said, capsys) -> None:
    assert run("simulate", *SMALL, *words, "--out", "d") == 2
    assert said in capsys.readouterr().err
    assert list(here.iterdir()) == []


def stl(size_mm: float) -> bytes:
    """A tetrahedron on its tip, as an STL file."""
    tip, *rim = size_mm * np.array([[0, 0, 0], [-0.5, -0.4, 0.3], [0.5, -0.4, 0.3], [0, 0.6, 0.3]])
    sides = [[tip, rim[0], rim[1]], [tip, rim[1], rim[2]], [tip, rim[2], rim[0]], rim]
    record = np.zeros(4, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    record["corners"] = sides
    return bytes(80) + np.uint32(4).tobytes() + record.tobytes()


def test_a_part_of_one_s_own_is_pressed_in(here, monkeypatch, capsys) -> None:
    (here / "cad").mkdir()
    (here / "cad" / "tip.STL").write_bytes(stl(4.0))
    words = ["simulate", *SMALL, "--scene", "cad/tip.STL", "--depth-mm", "0.9", "--out", "d"]
    monkeypatch.setattr("sys.argv", ["wedge", *words])
    assert run(*words) == 0
    assert "0 labelled presses, 1 shape with its truth" in capsys.readouterr().out
    names = {path.name for path in (here / "d").glob("*.jpg")}
    assert names == {"part.jpg", *(f"background_{index}.jpg" for index in range(4))}
    depth_mm = np.load(here / "d" / "truth" / "part.npy")
    assert 0.5 < depth_mm.max() < 0.9  # pixels of half a millimetre miss the tip
    digest = sha256(stl(4.0)).hexdigest()[:8]
    assert read_dataset(here / "d").card.source == (
        "wedge simulate --design finger --samples 4 --width-px 24 --scene tip.STL --depth-mm 0.9,"
        f" of the scene {digest}"
    )


@pytest.mark.parametrize(
    ("name", "content", "words", "said"),
    [
        ("part.stl", stl(0.02), [], "part.stl: the mesh is only 0.02 mm across: it seems to be in"),
        ("part.stl", stl(20_000), [], "part.stl: the mesh is 2e+04 mm across: its unit is not mm"),
        ("part.stl", stl(4)[:-9], [], "part.stl: the mesh has 0 triangles: give one of"),
        ("part.ply", b"ply\nformat ascii", [], "part.ply cannot be read as PLY: export it again."),
        ("part.obj", b"", [], "part.obj"),
        ("part.step", b"", [], "part.step is not an STL, PLY or OBJ file."),
        ("other.stl", b"", [], "part.stl cannot be read: No such file or directory."),
        ("part.stl", stl(9), ["--presses", "5"], "the scene part.stl has none: leave it out."),
        ("part.stl", stl(4), ["--depth-mm", "nan"], "part: a press of nan mm must be deeper than"),
        ("part.stl", stl(4), ["--depth-mm", "2"], "part: a press of 2 mm goes through the gel"),
        ("part.stl", stl(40), ["--depth-mm", "15"], "part of 40 x 40 mm is larger than the pad"),
    ],
)
def test_a_file_that_is_no_part_is_refused(here, name, content, words, said, capsys) -> None:
    (here / name).write_bytes(content)
    scene = name.replace("other", "part")
    assert run("simulate", *SMALL, "--scene", scene, *words, "--out", "d") == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in here.iterdir()] == [name]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--width-px", "0"], "--width-px 0 must be from 16"),
        (["--width-px", "-5"], "--width-px -5 must be from 16"),
        (["--samples", "0"], "--samples 0 must be from 1"),
        (["--presses", "1"], "--presses 1 must be at least 2"),
        (["--presses", "2"], "RGB: only 0 of 2 contacts would have a radius of 3 pixels"),
    ],
)
def test_sweep_refuses_before_it_renders(here, words, said, monkeypatch, capsys) -> None:
    monkeypatch.setattr("validation.sweep.write_set", None)
    assert run("sweep", "lights.lit_sides", "RGB", *SMALL, *words, "--out", "s") == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert list(here.iterdir()) == []


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a sweep of five presses wrote ``s.json``, and what it said: ``said.txt``."""
    folder = tmp_path_factory.mktemp("judged")
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(io.StringIO()) as said:
        in_one_process(patch)
        patch.chdir(folder)
        assert run(*FIVE_PRESSES, "--out", "s", "--json", "s.json") == 0
    (folder / "said.txt").write_text(said.getvalue())
    return folder


def test_one_judged_press_has_no_interval(judged: Path) -> None:
    document = json.loads((judged / "s.json").read_text())
    for point in document["points"]:
        assert point["presses"] == {"train": 4, "test": 1}
        for pixels in ("contact", "contact+5%"):
            assert point[pixels]["gx_mae"] > 0
            inferred = point[pixels]["missing_axis"] == "network"
            assert inferred == (point["inferred_axis"] is not None)
            assert set(point[pixels]["ci95"].values()) == {None}
    axes = {point["value"]: point["inferred_axis"] for point in document["points"]}
    assert axes == {"RGB": None, "R": "x", "G": "y"}  # green shines along x, red across it
    told = " ".join((judged / "said.txt").read_text().split())
    assert "4 + 1" in told and "of 5 rendered ones" in told
    assert "Gx of R is inferred" in told and "Gy of G is inferred" in told
    assert "[" not in told
    assert "1 press, too few for an interval" in told


@pytest.mark.parametrize("joined", [False, True])
def test_a_design_file_goes_by_its_name_into_the_card(joined, monkeypatch, tmp_path) -> None:
    path = str(tmp_path / "mine.toml")
    sources = set()
    words = [f"--design={path}"] if joined else ["--design", path]
    monkeypatch.setattr("sys.argv", ["wedge", "simulate", *words, "--out", "d"])
    told = "--design=mine.toml" if joined else "--design mine.toml"
    for pad_mm in (9.4, 9.0):  # one name, two sensors
        wanted = replace(FINGER, gel=replace(FINGER.gel, pad_width_mm=pad_mm))
        source = simulate._source(wanted, path, "balls")
        sources.add(source)
        assert source == f"wedge simulate {told}, of the design {wanted.sha256[:8]}"
    assert len(sources) == 2


def test_a_sweep_writes_down_what_it_left_out(here, capsys) -> None:
    (here / "dark.toml").write_text('base = "finger"\n[lights]\nblue_side_leds = 0\n')
    words = [word if word != "finger" else "dark.toml" for word in FIVE_PRESSES]
    assert run(*words, "--out", "s", "--json", "s.json") == 0
    document = json.loads((here / "s.json").read_text())
    assert [point["value"] for point in document["points"]] == ["R", "G"]
    ((value, reason),) = (row.values() for row in document["left_out"])
    assert value == "RGB" and "lights.blue_side_leds = 0" in reason
    assert f"left out {reason}" in capsys.readouterr().err


def test_a_design_that_cannot_be_cut_is_not_rendered(here, capsys) -> None:
    pytest.importorskip("cadquery")
    (here / "short.toml").write_text('base = "standard"\n[mirror]\nlength_mm = 25.0\n')
    assert run("simulate", "--design", "short.toml", "--out", "d") == 2
    assert "mirror.length_mm = 25" in capsys.readouterr().err
    assert run("sweep", "mirror.length_mm", "25", "--out", "s") == 2
    assert "\nleft out" not in capsys.readouterr().err
    assert run("sweep", "lights.red_side_leds", "12", "9", "--out", "s") == 2
    *left_out, last = capsys.readouterr().err.splitlines()
    assert [line.count("lights.red_side_leds = ") for line in left_out] == [1, 1]
    assert "= 12 LEDs" in left_out[0] and "= 9 must be at most 8" in left_out[1]
    assert "no value of lights.red_side_leds is left" in last
    assert [path.name for path in here.iterdir()] == ["short.toml"]


def test_a_design_is_not_checked_without_the_solid_modeller_which_is_named(
    monkeypatch, capsys
) -> None:
    monkeypatch.setitem(sys.modules, "cad.refusals", None)  # as if a package of it were missing
    refuse_unbuildable(FINGER)
    said = capsys.readouterr().err
    assert said.startswith("not checked whether the design can be built: that needs cad.refusals: ")
    assert said.endswith(f"{how_to_install('cad')}.\n")


def test_the_sweep_of_the_documentation_leaves_no_value_out(here, monkeypatch, capsys) -> None:
    page = (ROOT / "docs" / "howto" / "design.md").read_text(encoding="utf-8")
    (here / "thin.toml").write_text(page.partition("```toml\n")[2].partition("```")[0])
    (line,) = [line for line in page.splitlines() if line.startswith("wedge sweep ")]

    def stops(*_: object, **__: object) -> None:
        raise WedgeError("all can be built")

    monkeypatch.setattr(sweep, "process_pool", stops)
    assert run(*line.split()[1:]) == 2
    said = capsys.readouterr().err
    assert "all can be built" in said and "left out" not in said


def test_a_failure_in_the_middle_leaves_no_dataset(here, monkeypatch) -> None:
    def fails(*_: object) -> None:
        raise WedgeError("no more light")

    monkeypatch.setattr("simulation.dataset.trace_press", fails)
    assert run("simulate", *SMALL, "--presses", "2", "--out", "d") == 2
    assert list(here.iterdir()) == []


def test_a_lost_worker_is_a_sentence(here, monkeypatch, capsys) -> None:
    class Lost(InLine):
        def submit(self, fn, /, *args, **kwargs):
            raise BrokenExecutor("a child died")

    @contextmanager
    def pool():
        yield Lost()

    monkeypatch.setattr(sweep, "process_pool", pool)
    assert run("sweep", "lights.lit_sides", "RGB", *SMALL, "--out", "s") == 2
    assert "run the same command again" in capsys.readouterr().err


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """Address of a real Dask cluster of two processes."""
    distributed = pytest.importorskip("distributed")
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),  # of a task's workers
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as running,
    ):
        yield running.scheduler_address


def test_a_cluster_gives_the_same_numbers(here: Path, judged: Path, cluster: str) -> None:
    assert run(*FIVE_PRESSES, "--out", "s", "--json", "s.json", "--cluster", cluster) == 0
    documents = [json.loads((folder / "s.json").read_text()) for folder in (here, judged)]
    assert documents[0] == documents[1]


def test_what_a_lost_worker_was_doing_is_done_by_another(tmp_path: Path, cluster: str) -> None:
    died = str(tmp_path / "died")

    def dies_once() -> int:
        if not Path(died).exists():
            Path(died).touch()
            os._exit(1)
        return 7

    with cluster_pool(cluster) as executor:
        assert executor.submit(dies_once).result(timeout=60) == 7


def test_a_task_that_fails_is_not_tried_again(tmp_path: Path, cluster: str) -> None:
    tries = str(tmp_path / "tries")

    def fails() -> None:
        with Path(tries).open("a") as file:
            file.write("once ")
        raise WedgeError("no more light")

    with cluster_pool(cluster) as executor, pytest.raises(WedgeError, match="no more light"):
        executor.submit(fails).result(timeout=60)
    assert Path(tries).read_text() == "once "


def test_a_task_that_ends_every_worker_is_a_sentence(cluster: str) -> None:
    with pytest.raises(WedgeError, match="its workers keep ending"), cluster_pool(cluster) as pool:
        pool.submit(os._exit, 1).result(timeout=60)


def test_a_scheduler_that_is_lost_is_a_sentence(tmp_path: Path, capfd, caplog) -> None:
    distributed = pytest.importorskip("distributed")
    card, began = tmp_path / "scheduler.json", tmp_path / "began"

    def never_ends() -> None:
        began.touch()
        threading.Event().wait()

    with ExitStack() as ended:

        def started(program: str, *words: str) -> "subprocess.Popen[bytes]":
            command = [sys.executable, "-m", f"distributed.cli.{program}", "--no-dashboard", *words]
            process = ended.enter_context(subprocess.Popen(command, stderr=subprocess.DEVNULL))
            ended.callback(process.kill)
            return process

        place = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(card))
        scheduler = started("dask_scheduler", *place)
        until(lambda: card.exists() and bool(card.read_text()))  # made empty, then written
        address = json.loads(card.read_text())["address"]
        started("dask_worker", address, "--no-nanny")
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        with pytest.raises(WedgeError, match=f"{address} was lost.*run the same command again"):
            with cluster_pool(address) as pool:
                task = pool.submit(never_ends)
                until(began.exists)
                scheduler.kill()
                task.result(timeout=60)
    assert "Traceback" not in capfd.readouterr().err + caplog.text


def until(true: Callable[[], bool]) -> None:
    pause = threading.Event()
    for _ in range(10_000):
        if true():
            return
        pause.wait(0.005)
    raise AssertionError("never")


def test_an_address_where_nothing_answers_is_a_sentence(here, monkeypatch, capsys) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("app._cluster.PATIENCE_S", 0.3)
    arguments = ("sweep", "lights.lit_sides", "RGB", "--out", "s", "--cluster")
    assert run(*arguments, "tcp://127.0.0.1:9") == 2
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err
    # A client made for what is no address would print a traceback when it goes.
    monkeypatch.setattr("distributed.Client", lambda *_, **__: pytest.fail("it was made"))
    for address in ("nonsense://x", "garbage"):
        assert run(*arguments, address) == 2
        assert f"no Dask scheduler answers at {address}" in capsys.readouterr().err
