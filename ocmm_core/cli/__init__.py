"""The command line: ``ocmm``.

In: arguments. Out: files, tables on the terminal, and an exit code.

Read `_app` (which commands there are), `_measuring` with `_parts` and `_window` (those of
no room), and `_entry` (every fault becomes a sentence and an exit code). The commands stand in
`measure` (jobs, plans, reports, recall), `calibrate` (cameras, probes and tips), `bus` (cameras on
the wire) and `study` (fits, speeds, simulations); `terminal` is what they share. `calibrate` and
`study` do not know each other, nor do `bus` and `measure`.
Nobody imports it: the window starts from `composition`, as the commands do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli._app import app
    from ocmm_core.cli._entry import main
else:
    __getattr__ = door(__name__, _app="app", _entry="main")

__all__ = ["app", "main"]
