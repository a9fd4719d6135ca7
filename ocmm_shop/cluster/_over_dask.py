"""Connection to a Dask scheduler, of the shop or of this computer; see `_open_tasks`."""

from __future__ import annotations

import contextlib
import logging
import uuid
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import dask
from distributed import Client, LocalCluster
from distributed.security import Security

from ocmm_core.blas import use_one_thread
from ocmm_core.cleanup import scratch_folder
from ocmm_core.cluster import Cluster, Site
from ocmm_core.errors import OcmmError, StorageError
from ocmm_shop.cluster._open_tasks import Tasks

T = TypeVar("T")
R = TypeVar("R")

_CONFIG = {
    # Jobs of some megabytes are normal.
    "distributed.admin.large-graph-warning-threshold": "1GB",
    "distributed.comm.timeouts.connect": "15s",
    # A busy computer starts a new worker for a lost one in more than Dask's 15 s; after that time
    # the nanny of both would be closed for good.
    "distributed.deploy.lost-worker-timeout": "1h",
    # No HTTP server of Dask, no spilling to disk, which would write pickles.
    "distributed.scheduler.preload": ["ocmm_shop.cluster.no_page"],
    "distributed.worker.preload": ["ocmm_shop.cluster.no_page"],
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.OPENBLAS_NUM_THREADS": 1,
    "distributed.nanny.pre-spawn-environ.OMP_NUM_THREADS": 1,
}


def over_scheduler(
    site: Site,
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    contents: Callable[[T], Sequence[bytes]],
    on_done: Callable[[int], None],
) -> Iterator[R | OcmmError]:
    """Yield the result of each thing, computed by a scheduler's workers; see `run_tasks`."""
    security = None
    if site.scheduler.startswith("tls:"):
        security = Security(
            tls_ca_file=str(site.ca), tls_client_cert=str(site.cert),
            tls_client_key=str(site.key), require_encryption=True,
        )  # fmt: skip
    with _quiet(), dask.config.set(_CONFIG):
        tasks = Tasks(
            lambda seconds: _client(site.scheduler, security, seconds), site.scheduler,
            work, things, named, contents, on_done,
        )  # fmt: skip
        yield from tasks.run()


def over_local(
    workers: int,
    work: Callable[..., R],
    things: Sequence[T],
    named: Callable[[T], str],
    contents: Callable[[T], Sequence[bytes]],
    on_done: Callable[[int], None],
) -> Iterator[R | OcmmError]:
    """Yield results from local Dask processes; TLS: other users cannot run code in them."""
    use_one_thread()
    with (
        _quiet(),
        dask.config.set(_CONFIG),
        scratch_folder("workers") as scratch,
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
            dashboard_address=None, memory_limit=0, local_directory=str(scratch),
            silence_logs=logging.CRITICAL, security=Security.temporary(),
        ) as cluster,
    ):  # fmt: skip
        tasks = Tasks(
            lambda seconds: Client(cluster, timeout=seconds, set_as_default=False),
            cluster.scheduler_address, work, things, named, contents, on_done,
        )  # fmt: skip
        yield from tasks.run()


def _client(address: str, security: Security | None, seconds: float) -> Client:
    try:
        return Client(
            address, security=security, timeout=seconds, set_as_default=False,
            name=f"ocmm-{uuid.uuid4().hex[:8]}",
        )  # fmt: skip
    except (OSError, TimeoutError, ValueError) as error:
        lines = str(error).strip().splitlines()
        why = lines[0][:200] if lines else type(error).__name__
        raise StorageError(
            "cluster.unreachable",
            f"The scheduler {address} cannot be reached ({why}).",
            "Check that it runs and that its certificates are of the same CA, then run this again.",
        ) from error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hide Dask's log of lost workers: only an answer or an error counts."""
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado")]
    before = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for one, level in zip(loggers, before, strict=True):
            one.setLevel(level)


DASK = Cluster(over_scheduler, over_local)
