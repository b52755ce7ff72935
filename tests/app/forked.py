# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line in processes of its own that need not import anything anew.

Importing what serves a page takes longer than most tests of a page. So one process imports it and
forks into those that are asked for.
"""

import contextlib
import multiprocessing
import os
from collections.abc import Iterator
from multiprocessing.connection import Connection
from typing import TextIO

from app.__main__ import main

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload(["tests.app.warmed"])


@contextlib.contextmanager
def running(*words: object) -> Iterator[TextIO]:
    """What a command prints while it runs; it is ended with the context."""
    reader, writer = FORKS.Pipe(duplex=False)
    # By its name, NiceGUI knows the process that serves.
    process = FORKS.Process(target=_run, name="MainProcess", args=(list(map(str, words)), writer))
    process.start()
    writer.close()
    try:
        with os.fdopen(os.dup(reader.fileno())) as output:
            yield output
    finally:
        reader.close()
        process.terminate()
        process.join()


def _run(words: list[str], output: Connection) -> None:
    """The command, as a shell would start it."""
    os.dup2(output.fileno(), 1)
    # NiceGUI serves otherwise where it sees pytest.
    for name in [name for name in os.environ if "PYTEST" in name]:
        del os.environ[name]
    main(words)
