"""`ocmm archive`: upload, query, export, rebuild and verify jobs of all stations.

In: an archive and an outbox. Out: tables, files, an exit code.

Read `_app` (the group and its options), `_archive`, `_ask` and `_check` (the commands), collected
by `_commands`, `_hand_over` (upload after measuring), `_shown` (tables on the terminal).
`ocmm_shop.archive` answers the queries; here they are printed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_cli.archive._commands import archive_app
    from ocmm_cli.archive._hand_over import MeasuredJobs
else:
    __getattr__ = door(__name__, _commands="archive_app", _hand_over="MeasuredJobs")

__all__ = ["MeasuredJobs", "archive_app"]
