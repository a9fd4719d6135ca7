"""The main window and what it opens: sheets, the pages of Maintain, and its files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.window._main_window import MainWindow
else:
    __getattr__ = door(
        __name__,
        _main_window="MainWindow",
    )

__all__ = [
    "MainWindow",
]
