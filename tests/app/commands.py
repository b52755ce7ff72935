# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line in the process of the test."""

import pytest

from app.__main__ import main


def run(*words: object) -> int:
    """The exit status of a command."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    status = ended.value.code or 0
    assert isinstance(status, int)
    return status


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """The one sentence that a refused command prints."""
    capsys.readouterr()
    assert run(*words) == 2
    sentence = capsys.readouterr().err.strip().splitlines()[-1]
    assert sentence.startswith("wedge: ")
    assert "Traceback" not in sentence
    return sentence
