"""The command line: ``ocmm``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli._app import app
    from ocmm_core.cli._entry import main
else:
    __getattr__ = door(
        __name__,
        _app="app",
        _entry="main",
    )

__all__ = [
    "app",
    "main",
]
