"""What a scheduler is asked beside its tasks."""

from __future__ import annotations

import contextlib

from distributed import Client

from ocmm_core.cluster._sentences import other_processor, other_version
from ocmm_core.cluster._worker import Computer, this_computer, versions
from ocmm_core.errors import InputError


def check_all(client: Client, ours: Computer) -> None:
    """Raise InputError where the scheduler or a worker could give other digits.

    The scheduler computes nothing: its processor may be any.
    """
    scheduler = _of_scheduler(client)
    if scheduler != ours.versions:
        raise other_version("The scheduler", _named(scheduler), ours.versions)
    for worker, theirs in client.run(this_computer, on_error="return").items():
        if theirs != ours:
            raise refusal(f"Worker {worker}", theirs, ours)


def refusal(who: str, theirs: object, ours: Computer) -> InputError:
    """Return why a worker that is not like this computer could give other digits."""
    if not isinstance(theirs, Computer):
        # One that knows no such thing is of another version.
        return other_version(who, _named(theirs), ours.versions)
    if theirs.versions != ours.versions:
        return other_version(who, theirs.versions, ours.versions)
    there = theirs.arithmetic.environment_of(ours.arithmetic)
    here = ours.arithmetic.environment_of(theirs.arithmetic)
    return other_processor(who, str(theirs.arithmetic), str(ours.arithmetic), there, here)


def _named(found: object) -> str:
    return found if isinstance(found, str) else f"another version ({type(found).__name__})"


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
