"""Files named by a plan, such as pictures and models: next to it or in a subfolder."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.inspection.plan._step_checks import file_fault
from ocmm_core.side_files import has_content

MOST_NAMES = 1000


@dataclass(frozen=True, slots=True)
class FileKind:
    code: str
    """Part of its error codes, and fallback file name."""
    words: str
    endings: Sequence[str]

    def kept(self, source: Path, content: bytes, folder: Path) -> str:
        """Return the name of a file in the folder of a plan; it is copied if outside.

        A copy gets a portable, unused name. StorageError if it cannot be copied.
        """
        return self.inside(source, folder) or self._copied(source, content, folder)

    def write(self, target: Path, content: bytes) -> None:
        """Write a file; StorageError if that fails."""
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(target, content)
        except OSError as error:
            raise self.not_written(target, error) from error

    def not_written(self, target: Path, error: OSError) -> StorageError:
        return StorageError(
            f"plan.{self.code}_not_written",
            f"{target}: the {self.words} cannot be written ({error.strerror or error}).",
            "Choose a writable folder with enough space.",
        )

    def no_name(self, folder: Path, stem: str) -> StorageError:
        return StorageError(
            f"plan.{self.code}_names",
            f"{folder}: no free file name for {stem}.",
            "Rename the file.",
        )

    def inside(self, source: Path, folder: Path) -> str:
        """Return the name of a file relative to the folder of the plan; empty if outside."""
        source = source.absolute()
        if not source.is_relative_to(folder):
            return ""
        name = source.relative_to(folder).as_posix()
        return "" if file_fault(name, self.words, self.endings) else name

    def stem(self, source: Path) -> str:
        """Return a portable name without its ending."""
        return re.sub(r"[^A-Za-z0-9_\-]+", "_", source.stem).strip("_-")[:60] or self.code

    def _copied(self, source: Path, content: bytes, folder: Path) -> str:
        stem = self.stem(source)
        for number in range(1, MOST_NAMES):
            name = f"{stem}{'' if number == 1 else f'-{number}'}{source.suffix.lower()}"
            target = folder / name
            if not target.exists():
                self.write(target, content)
                return name
            if has_content(target, content):
                return name
        raise self.no_name(folder, stem)
