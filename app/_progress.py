# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A line on stderr that says how far a step is and how long it will still take."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

_TITLE_WIDTH = 32


class Report(Protocol):
    """Takes how far a step is."""

    def __call__(self, share: float, what: str = "") -> None:
        """Show the share that is done, 0 to 1, and what was done last."""


@contextmanager
def progress(title: str) -> Iterator[Report]:
    """Show a bar while the block runs: the time it will still take, at the end the time it took.

    The line stays, so that steps which follow each other read as a log; they do not nest. Where
    stderr is no terminal, only the finished line is printed. What is refused at once leaves none.
    """
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("[dim]{task.fields[what]}"),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console) as bar:
        step = bar.add_task(escape(f"{title:{_TITLE_WIDTH}}"), total=1.0, what="")

        def report(share: float, what: str = "") -> None:
            bar.update(step, completed=share, what=escape(what))

        try:
            yield report
        except BaseException:
            if not bar.tasks[step].completed:
                bar.update(step, visible=False)
                console.quiet = not console.is_terminal
            raise
        bar.update(step, completed=1.0, what="")
