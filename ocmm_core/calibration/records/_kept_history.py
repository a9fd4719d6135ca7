"""The entries of a history that this program knows, and their rescue if its file is lost."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from ocmm_core.calibration.records._chain_seal import NAME, SignedSeal
from ocmm_core.calibration.records._evidence import Stamp, stamp_of
from ocmm_core.calibration.records._sealed import seal
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import read_bytes
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.named_file import write_rescued


class KeptHistory:
    """The longest known chain of a folder, compared with the file under its name.

    Additions by other programs, or a backup with all entries, lose nothing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._chain: ChainFile[Any] | None = None
        self._seal: SignedSeal | None = None
        self._saved_seal: Path | None = None
        self._whole: Stamp | None = None

    def note(self, chain: ChainFile[Any], found: SignedSeal | None) -> None:
        """Keep a chain and its seal, unless known entries are missing in it."""
        kept = self._chain
        if kept is None or kept.links == chain.links[: len(kept.links)]:
            self._chain, self._seal = chain, found

    def loss(self) -> StorageError | None:
        """Return why entries are missing (saved elsewhere with their seal), or None."""
        kept, stamp = self._chain, None
        if kept is None or not kept.links:
            return None
        with contextlib.suppress(OSError, OcmmError):
            stamp = stamp_of(self._path)
            if stamp is not None and stamp != self._whole:
                content = read_bytes(self._path, follow=False)
                self._whole = None if kept.begins(content) is None else stamp
        if stamp is not None and stamp == self._whole:
            return None
        lost = kept.lost("another program has written into it or replaced it")
        if self._seal is not None and self._saved_seal is None:
            self._saved_seal = write_rescued(NAME, seal(self._seal))
        also = f" Its seal is saved in {self._saved_seal}." if self._saved_seal else ""
        return StorageError(
            lost.code,
            lost.what + also,
            f"Copy the saved files back as {self._path.name} and {NAME}, then repeat the last "
            "step.",
        )
