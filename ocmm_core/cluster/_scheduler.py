"""What a scheduler is asked beside its tasks."""

from __future__ import annotations

import contextlib

from distributed import Client

from ocmm_core.cluster._worker import versions


def all_versions(client: Client) -> dict[str, str]:
    """Return the versions of all; one that knows no such thing is of another version."""
    found: dict[str, object] = {"The scheduler": _of_scheduler(client)}
    for worker, one in client.run(versions, on_error="return").items():
        found[f"Worker {worker}"] = one
    return {
        name: one if isinstance(one, str) else f"another version ({type(one).__name__})"
        for name, one in found.items()
    }


def _of_scheduler(client: Client) -> object:
    # It unpacks what it hands on, so it needs the same packages.
    try:
        return client.run_on_scheduler(versions)
    except Exception as error:
        return error


def has_workers(client: Client) -> bool:
    """Return whether a worker is there; False also where nobody says so."""
    with contextlib.suppress(Exception):
        return bool(client.nthreads())
    return False
