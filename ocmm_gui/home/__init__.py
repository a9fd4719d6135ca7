"""Where one begins: the Start page, the settings, files, and the search for an action.

In: settings of the core, jobs and plans that lie about. Out: what is to be opened, and changed
settings.

Read `_start_page` (what can be begun) in `_start_window` (before there is a station), with
`_plan_list`; `_settings_page` with `_setting_row`, one a setting, and
`_template_preview` (the first page of a report, drawn in another process);
`_key_list` (keys of the window, to be changed); `_file_browser` (files, beside the measuring);
`_find_action` (type what you want).
It loads no numerical library by itself: what needs one is asked for in a thread, behind the page.
It must not know a running station.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.home._file_browser import FileBrowser
    from ocmm_gui.home._find_action import FindAction
    from ocmm_gui.home._settings_page import SettingsPage
    from ocmm_gui.home._start_page import StartPage
    from ocmm_gui.home._start_window import Choice, Errands, StartWindow
else:
    __getattr__ = door(
        __name__,
        _file_browser="FileBrowser",
        _find_action="FindAction",
        _settings_page="SettingsPage",
        _start_page="StartPage",
        _start_window="Choice Errands StartWindow",
    )

__all__ = [
    "Choice",
    "Errands",
    "FileBrowser",
    "FindAction",
    "SettingsPage",
    "StartPage",
    "StartWindow",
]
