"""Queue the jobs of a running station in the outbox of the archive, as soon as they are saved.

In: a job that is finished, paused or closed. Out: the same in the outbox; the sender delivers it.

See `_watch` (a separate thread; archive and outbox of the settings). It must not know an archive:
measuring does not depend on a server.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_shop.archiving._watch import ArchiveWatch, archive_place, is_off
else:
    __getattr__ = door(__name__, _watch="ArchiveWatch archive_place is_off")

__all__ = ["ArchiveWatch", "archive_place", "is_off"]
