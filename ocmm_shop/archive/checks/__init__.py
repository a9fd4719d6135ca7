"""Rebuild of an archive from job files, and its verification against them.

In: an archive, job files. Out: an archive with the same rows, or the differences.

Read `_rebuild`, then `_verify`. It must not know how jobs come.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.archive.checks._rebuild import (
        Rebuilt, files_in, files_of, key_and_name, rebuild, stations_of,
    )  # fmt: skip
    from ocmm_shop.archive.checks._verify import (
        Checked, differences, mark_altered, records_of, verify_archive, verify_files,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Checked", "Rebuilt", "differences", "files_in", "files_of", "key_and_name", "mark_altered",
    "rebuild", "records_of", "stations_of", "verify_archive", "verify_files",
]  # fmt: skip
