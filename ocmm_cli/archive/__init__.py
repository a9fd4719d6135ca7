"""`ocmm archive`: upload, query, export, rebuild and verify jobs of all stations.

In: an archive and an outbox. Out: tables, files, an exit code.

Read `_app` (the group and its options), `_archive`, `_ask` and `_check` (the commands), collected
by `_commands`, `_shown` (tables on the terminal). `_archive` also uploads after measuring.
`ocmm_shop.archive` answers the queries; here they are printed.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_cli.archive._archive import MeasuredJobs
    from ocmm_cli.archive._commands import archive_app
else:
    __getattr__ = door(__name__)

__all__ = ["MeasuredJobs", "archive_app"]
