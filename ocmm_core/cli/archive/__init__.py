"""`ocmm archive`: jobs of all stations, handed over, asked, exported, made again and verified.

In: an archive and an outbox. Out: tables, files, an exit code.

Read `_app` (the group and its options), `_archive`, `_ask` and `_check` (the commands) which
`_commands` brings together, `_hand_over` (what a command that measures does), `_shown` (tables on
the terminal). Questions are answered by `ocmm_core.archive`; here they are printed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cli.archive._commands import archive_app
    from ocmm_core.cli.archive._hand_over import MeasuredJobs
else:
    __getattr__ = door(__name__, _commands="archive_app", _hand_over="MeasuredJobs")

__all__ = ["MeasuredJobs", "archive_app"]
