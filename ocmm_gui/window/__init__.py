"""The main window and its sheets, Maintain pages, and files.

In: the bridge of a station, and settings of the start. Out: one window with all screens.

Read `_main_window` (contents, and the action of each key), `_pages` (the current page),
`_running_job` (the live readout, the job on it, and files written by keys), `_sheets` (results,
reports, plan, alignment, job), `_maintenance` (Maintain and the wizards, and their follow-ups).
It joins packages that do not know each other. Only `ocmm_gui.app` imports it.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.window._main_window import REOPEN, START, MainWindow
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["REOPEN", "START", "MainWindow"]
