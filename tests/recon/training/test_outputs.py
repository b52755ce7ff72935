# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Trainings say that the weights could not be written, before their hours where it is known."""

from importlib import import_module

import numpy as np
import pytest

pytest.importorskip("torch")


each_command = pytest.mark.parametrize(
    "command",
    [
        "contact --steps 2,2",
        "contact_further no-weights --sensor no-balls no-set",
        "missing_axis --steps 2 --workers 0 --channels 1,1",
        "missing_axis_further no-weights --sensor no-balls no-set",
    ],
)


@pytest.mark.parametrize("ending", [".safetensors", ".csv", ".png"])
@each_command
def test_weights_that_cannot_be_written_are_refused_before_the_work(
    command, ending, tmp_path, monkeypatch, capsys
):
    module, *words = command.split()
    weights = tmp_path / "weights.safetensors"
    weights.with_suffix(ending).mkdir()
    monkeypatch.setattr("sys.argv", [module, *words, "--out", str(weights)])
    training = import_module(f"recon.training.{module}")
    for work in {"train"} & set(vars(training)):
        monkeypatch.setattr(training, work, lambda *_: pytest.fail("it began"))
    with pytest.raises(SystemExit, match="2"):
        training.main()
    assert f"{weights.with_suffix(ending)} cannot be written: it is a folder" in (
        capsys.readouterr().err
    )


@each_command
def test_weights_that_cannot_be_written_in_the_end_are_a_sentence(
    command, tmp_path, monkeypatch, capsys
):
    module, *words = command.split()
    weights = tmp_path / "weights.safetensors"
    monkeypatch.setattr("sys.argv", [module, *words, "--out", str(weights)])
    training = import_module(f"recon.training.{module}")

    def learnt(*_, **__):
        weights.mkdir()  # what takes its place while it is learnt
        return {"a": np.zeros(1, np.float32)}, [0.0]

    for name, work in {
        "load_weights": lambda *_: {},
        "felt_presses": lambda *_: [None],
        "measured_presses": lambda *_: [None],
        "train": learnt,
        "train_further": learnt,
        "train_doubt": lambda kept, *_: (kept, [0.0]),
    }.items():
        if name in vars(training):
            monkeypatch.setattr(training, name, work)
    monkeypatch.setattr("recon.unet.stride", lambda _: 1)
    with pytest.raises(SystemExit, match="2"):
        training.main()
    assert f": {weights} cannot be written: Is a directory." in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [weights.name]


@each_command
@pytest.mark.parametrize("words", ["", "kept: go on"])
def test_ctrl_c_ends_in_a_sentence(command, words, tmp_path, monkeypatch, capsys):
    module, *others = command.split()
    monkeypatch.setattr("sys.argv", [module, *others, "--out", str(tmp_path / "w.safetensors")])
    training = import_module(f"recon.training.{module}")

    def interrupted(*_, **__):
        raise KeyboardInterrupt(words)

    work = "train" if "train" in vars(training) else "load_weights"
    monkeypatch.setattr(training, work, interrupted)
    with pytest.raises(SystemExit, match="130"):
        training.main()
    sentence = f"python -m recon.training.{module}: {words or 'interrupted'}\n"
    assert capsys.readouterr().err == sentence


def test_ctrl_c_while_the_result_is_measured_ends_in_a_sentence(tmp_path, monkeypatch, capsys):
    training = import_module("recon.training.missing_axis")
    words = "missing_axis --workers 0 --steps 2 --out".split()
    monkeypatch.setattr("sys.argv", [*words, str(tmp_path / "w.safetensors")])

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(training, "train", lambda *_: ({"a": np.zeros(1, np.float32)}, [1.0, 0.5]))
    monkeypatch.setattr(training, "print_measures", interrupted)
    with pytest.raises(SystemExit, match="130"):
        training.main()
    assert capsys.readouterr().err.endswith("missing_axis: interrupted\n")
    assert (tmp_path / "w.safetensors").is_file()


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("missing_axis --recipes paper,contcat", "'contcat' is none of"),
        ("missing_axis --seed -1", "'-1' is no whole number from 0 on"),
        ("missing_axis --workers -2", "'-2' is no whole number from 0 on"),
        ("missing_axis_further no-weights --sensor no-balls no-set --seed -1", "'-1'"),
        ("contact --seed -1", "'-1'"),
        ("contact_further no-weights --sensor no-balls no-set --seed 1.5", "'1.5'"),
    ],
)
def test_words_that_mean_nothing_are_refused(command, said, tmp_path, monkeypatch, capsys):
    module, *words = command.split()
    monkeypatch.setattr("sys.argv", [module, *words, "--out", str(tmp_path / "w.safetensors")])
    training = import_module(f"recon.training.{module}")
    for work in {"train"} & set(vars(training)):
        monkeypatch.setattr(training, work, lambda *_: pytest.fail("it began"))
    with pytest.raises(SystemExit, match="2"):
        training.main()
    assert said in capsys.readouterr().err


def test_the_losses_of_both_courses_are_kept_beside_the_weights(tmp_path, monkeypatch):
    training = import_module("recon.training.missing_axis_further")
    for name, work in {
        "load_weights": lambda *_: {},
        "measured_presses": lambda *_: [None],
        "train_further": lambda *_: ({}, [3.0, 2.0]),
        "train_doubt": lambda kept, *_: (kept, [5.0]),
        "save_weights": lambda *_: None,
        "print_measures": lambda *_: None,
    }.items():
        monkeypatch.setattr(training, name, work)
    monkeypatch.setattr("recon.unet.stride", lambda _: 1)
    words = "further first --sensor balls set --out".split()
    monkeypatch.setattr("sys.argv", [*words, str(tmp_path / "w.safetensors")])
    training.main()
    assert (tmp_path / "w.csv").read_text().splitlines()[1:] == ["1,3.000000", "2,2.000000"]
    assert (tmp_path / "w-doubt.csv").read_text().splitlines()[1:] == ["1,5.000000"]
    assert (tmp_path / "w-doubt.png").stat().st_size > 1000
