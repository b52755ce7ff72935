# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The line that says how far a step is says what it was given, whatever that is."""

import pytest

from app._progress import progress


@pytest.mark.parametrize("words", ["set{1}", "x {y", "}", "{task.id}", "[bold]a[/bold]", "[/]"])
def test_a_title_is_shown_as_it_is(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with progress(words) as show:
        show(0.5, words)
    told = capsys.readouterr().err
    assert told.startswith(f"{words:32} ")
    assert "100 %" in told
