"""Authors and dates in chain files: register, interim checks, test steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ocmm_core.acceptance import _events as log
from ocmm_core.acceptance._interim import INTERIM, InterimCheck
from ocmm_core.acceptance._register import REGISTER, ArtefactRegister
from ocmm_core.chain_file import ChainFile
from ocmm_core.seals import SealState, Signed


def chain_history(path: Path) -> tuple[Signed, SealState, tuple[tuple[str, str, str], ...]]:
    """Return kind, signature state and lines (UTC, author, text); errors as `ChainFile`."""
    if path.name == REGISTER:
        register = ArtefactRegister(path.parent)
        return Signed.ARTEFACTS, register.signer, register.changes
    if path.name == INTERIM:
        checks: ChainFile[Any] = ChainFile(
            path, InterimCheck, signed=Signed.INTERIM, remembered=True
        )
        rows = tuple(
            (one.utc, "", f"check of {one.artefact}: {1e3 * one.error_mm:+.1f} µm")
            for one in checks.items
        )
        return Signed.INTERIM, checks.signer, rows
    steps = ChainFile(path, log.Line, signed=Signed.TEST, remembered=True)
    begun = steps.items[0].event if steps.items else None
    who = begun.made_by if isinstance(begun, log.Begun) else ""
    return (
        Signed.TEST,
        steps.signer,
        tuple((one.event.utc, who, type(one.event).__name__) for one in steps.items),
    )
