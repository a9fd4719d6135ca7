"""The main window and what it opens: sheets, the pages of Maintain, and its files.

In: the bridge of a station, and settings of the start. Out: one window with all screens.

Read `_main_window` (what there is, and what each key calls), `_pages` (which of them is shown),
`_running_job` (the live readout and the job on it), `_sheets` (results, reports, plan, alignment,
job), `_maintenance` (Maintain and the wizards, and what they lead to), `_output` (files
that a key writes), `_keys_sheet` (all keys on one page).
It joins rooms that do not know each other. Only `ocmm_gui.app` imports it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.window._main_window import REOPEN, START, MainWindow
else:
    __getattr__ = door(__name__, _main_window="MainWindow REOPEN START")

__all__ = ["REOPEN", "START", "MainWindow"]
