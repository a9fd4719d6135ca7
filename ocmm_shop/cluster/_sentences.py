"""Errors about a scheduler and its workers, with remedies."""

from __future__ import annotations

import shlex
from collections.abc import Mapping

from ocmm_core.errors import InputError, InternalError, OcmmError, StorageError


def not_reached(address: str, why: str) -> StorageError:
    return StorageError(
        "cluster.unreachable",
        f"The scheduler {address} cannot be reached ({why}).",
        "Check that it runs and that its certificates are of the same CA, then run this again.",
    )


def scheduler_lost(address: str) -> StorageError:
    return StorageError(
        "cluster.lost",
        f"The scheduler {address} was lost several times before one more task was done.",
        "Look at its log, then run this again: nothing was stored.",
    )


def no_workers(address: str, seconds: float) -> StorageError:
    return StorageError(
        "cluster.no_workers",
        f"The scheduler {address} had no worker for {seconds:.0f} s.",
        "Start workers (docs/integrator/cluster.md), then run this again.",
    )


def other_version(who: str, theirs: str, ours: str) -> InputError:
    return InputError(
        "cluster.version",
        f"{who} has {theirs}; this computer has {ours}. Their digits could differ.",
        "Install the same program there and start it again, or stop it, then run this again.",
    )


def other_processor(
    who: str, theirs: str, ours: str, there: Mapping[str, str] | None,
    here: Mapping[str, str] | None,
) -> InputError:  # fmt: skip
    """Return the error of another processor; `there`, `here`: possible environments, or None."""
    if there:
        remedy = f"Start that worker with {_assigned(there)}"
    elif here:
        remedy = f"Run this again with {_assigned(here)}"
    else:
        remedy = "Stop that worker"
    return InputError(
        "cluster.processor",
        f"{who} computes otherwise ({theirs}) than this computer ({ours}). Last digits could "
        "differ.",
        f"{remedy}, or leave out --scheduler to compute here (docs/integrator/cluster.md).",
    )


def _assigned(environment: Mapping[str, str]) -> str:
    return " ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items())


def altered(sha256: str) -> StorageError:
    return StorageError(
        "cluster.content",
        f"Content {sha256[:12]} arrived altered at a worker.",
        "Run this again; if it happens again, check that nobody else uses this scheduler.",
    )


def died(name: str) -> OcmmError:
    """Return the error that every worker that tried a task ended."""
    return InternalError(
        "cluster.died",
        f"{name} ended every worker that tried it; their memory may be too small.",
        "Compute it here, or start workers with more memory.",
    )
