"""The workers of a blind test: a Dask cluster started on loopback, or a cluster that is already running."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client, LocalCluster

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch

_CONNECT_SECONDS = 10


@contextmanager
def cluster(scheduler: str | None, workers: int) -> Iterator[Client]:
    """A client of the cluster at `scheduler`, or of a new local one of `workers` processes. UserError: no scheduler there."""
    if scheduler is not None:
        try:
            running = Client(scheduler, timeout=_CONNECT_SECONDS)
        except (OSError, ValueError) as error:
            expected = "expected the address of a Dask scheduler that runs, tcp://HOST:PORT"
            raise UserError(f"--scheduler {scheduler}: no scheduler answers there ({error}); {expected}") from None
        with running as client:
            yield client
        return
    with scratch() as folder, _local(workers, folder) as local, Client(local) as client:
        yield client


def _local(workers: int, folder: Path) -> LocalCluster:
    """Processes of this machine whose temporary files, and those of what they start, are all in `folder`."""
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
        memory_limit=0,  # no limit and therefore no spilling: what a worker knows never gets to a disk
        silence_logs=logging.CRITICAL,
        local_directory=str(folder),
        env={"TMPDIR": str(folder)},
    )
