# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A Dask cluster as an executor like any other."""

import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager

from sensor.errors import WedgeError
from sensor.extras import how_to_install

PATIENCE_S = 10


@contextmanager
def cluster_pool(address: str) -> Iterator[Executor]:
    """The workers of a Dask cluster; what a lost one was doing, the scheduler gives to others.

    Raises:
        WedgeError: Dask is not installed, nothing answers, no worker is there, or they are lost.
    """
    try:
        from distributed import Client
        from distributed.comm.addressing import get_address_host_port
        from distributed.scheduler import KilledWorker
    except ModuleNotFoundError as error:
        raise WedgeError(f"--cluster needs {error.name}: {how_to_install('cluster')}.") from error
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # it prints tracebacks
    try:
        # A client that is made for what is no address prints a traceback when it goes.
        get_address_host_port(address)
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        raise WedgeError(
            f"no Dask scheduler answers at {address}: start one with `dask scheduler` and name "
            "its address, such as tcp://127.0.0.1:8786."
        ) from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise WedgeError(f"the Dask scheduler at {address} has no workers: start some.")
        try:
            yield client.get_executor()  # type: ignore[no-untyped-call]
        except (CancelledError, KilledWorker) as error:
            raise WedgeError(
                f"the Dask scheduler at {address} was lost, or its workers keep ending, perhaps "
                "for lack of memory: correct that and run the same command again; what is "
                "rendered is kept."
            ) from error
