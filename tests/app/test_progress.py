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


@pytest.mark.parametrize("begun", [True, False])
def test_what_is_refused_at_once_shows_no_bar(
    begun: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match="refused"), progress("a step") as show:
        if begun:
            show(0.3)
        raise ValueError("refused")
    told = capsys.readouterr().err
    assert ("a step" in told and "30 %" in told) if begun else not told.strip()
