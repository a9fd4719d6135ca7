"""A disk that changes data while a report is written."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from ocmm_core.documents import written_beside
from ocmm_core.export import _registry as files


def spoil_files(monkeypatch: pytest.MonkeyPatch, spoil: Callable[[Path, bytes], bytes]) -> None:
    """Let every file of a report hold what ``spoil`` makes of its name and content."""

    def write(path: Path, content: bytes) -> AbstractContextManager[Path]:
        return written_beside(path, spoil(path, content))

    monkeypatch.setattr(files, "written_beside", write)
