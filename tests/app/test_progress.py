# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The line that says how far a step is says what it was given, whatever that is."""

import re

import pytest

from app._progress import progress
from sensor.errors import WedgeError


@pytest.mark.parametrize("words", ["set{1}", "x {y", "}", "{task.id}", "[bold]a[/bold]", "[/]"])
def test_a_title_is_shown_as_it_is(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with progress(words) as show:
        show(0.5, words)
    told = capsys.readouterr().err
    assert told.startswith(f"{words:32} ")
    assert "100 %" in told


@pytest.mark.parametrize("terminal", [False, True])
@pytest.mark.parametrize(("share", "left"), [(None, ""), (0.0, ""), (0.3, "30 %")])
def test_what_is_refused_before_anything_is_done_leaves_no_bar(
    terminal: bool,
    share: float | None,
    left: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if terminal:
        monkeypatch.setenv("FORCE_COLOR", "1")
    with pytest.raises(WedgeError), progress("reconstruction") as show:
        if share is not None:
            show(share, "reading")
        raise WedgeError("it is not there.")
    # What a terminal erases is gone.
    told = re.sub(r"\x1b\[\??[\d;]*[a-zA-Z]", "", capsys.readouterr().err.split("\x1b[2K")[-1])
    assert (left in told and told.startswith("reconstruction")) if left else told == ""
