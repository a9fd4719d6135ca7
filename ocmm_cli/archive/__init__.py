"""`ocmm archive`: upload, query, export, rebuild and verify jobs of all stations.

In: an archive and an outbox. Out: tables, files, an exit code.

Read `_archive` (the group, and upload after measuring), `_ask` (queries, their
tables, rebuild, verify).
`ocmm_shop.archive` answers the queries; here they are printed.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.archive._archive import MeasuredJobs
    from ocmm_cli.archive._ask import archive_app
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["MeasuredJobs", "archive_app"]
