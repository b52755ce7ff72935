# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Trainings say before their hours that the weights could not be written."""

from importlib import import_module

import pytest

pytest.importorskip("torch")


@pytest.mark.parametrize(
    "command",
    [
        "contact --steps 2,2",
        "contact_further no-weights --sensor no-balls no-set",
        "missing_axis --steps 2 --workers 0",
        "missing_axis_further no-weights --sensor no-balls no-set",
    ],
)
def test_weights_that_cannot_be_written_are_refused_before_the_work(
    command, tmp_path, monkeypatch, capsys
):
    module, *words = command.split()
    (tmp_path / "taken").touch()
    weights = tmp_path / "taken" / "weights.safetensors"
    monkeypatch.setattr("sys.argv", [module, *words, "--out", str(weights)])
    training = import_module(f"recon.training.{module}")
    for work in {"train", "run"} & set(vars(training)):
        monkeypatch.setattr(training, work, lambda *_: pytest.fail("it began"))
    with pytest.raises(SystemExit, match="2"):
        training.main()
    assert f"{weights} cannot be written: {tmp_path / 'taken'} is no folder" in (
        capsys.readouterr().err
    )
