# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every test shares: the same examples at every run, none judged by the clock, one cache, and
one browser for all pages."""

import gc
import os
import signal
from collections.abc import Generator, Iterator
from pathlib import Path

import hypothesis
import pytest

import tests.signatures  # noqa: F401  (jaxtyping looks for it when recon is imported)
from tests.browser import close_browsers

# Kept from run to run, as imports and compiling take a while; the user's own stays as it is.
os.environ["WEDGE_CACHE"] = str(Path(__file__).resolve().parents[1] / "build" / "test-cache")

# No test outlives a power cut, and thousands of files would each wait for the disk.
os.fsync = lambda _: None

hypothesis.settings.register_profile("same-every-run", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same-every-run")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What imports have made stays: nobody looks through its million objects for garbage."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture
def usual_ctrl_c() -> Iterator[None]:
    """Whoever runs the tests may have told them to ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session", autouse=True)
def browsers() -> Iterator[None]:
    """Those that tests have started end with the last test."""
    yield
    close_browsers()
