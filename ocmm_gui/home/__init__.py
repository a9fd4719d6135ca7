"""Start page, settings, files, and action search.

In: settings of the core, existing jobs and plans. Out: the file or errand to open, and changed
settings.

Start with `_start_page` (choices) in `_start_window` (before there is a station), with
`_start_lists`; then `_settings_page` with `_setting_row` (one per setting, and the first report
page, drawn in another process) and `_settings_parts` (keys, playable sounds); `_file_browser`;
`_find_action`.
It imports no numerical library itself: such work runs in a background thread.
It must not import a running station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.home._file_browser import FileBrowser
    from ocmm_gui.home._find_action import FindAction
    from ocmm_gui.home._settings_page import SettingsPage
    from ocmm_gui.home._start_page import StartPage
    from ocmm_gui.home._start_window import StartChoice, StartPurpose, StartWindow
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FileBrowser", "FindAction", "SettingsPage", "StartChoice", "StartPage", "StartPurpose",
    "StartWindow",
]  # fmt: skip
