"""Queue the jobs of a running station in the outbox of the archive, as soon as they are saved.

In: a job that is finished, paused or closed. Out: the same in the outbox; the sender delivers it.

Read `_watch` (a separate thread), `_place` (archive and outbox of the settings). It must not know
an archive: measuring does not depend on a server.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_shop.archiving._place import archive_place, is_off
    from ocmm_shop.archiving._watch import ArchiveWatch
else:
    __getattr__ = door(__name__, _place="archive_place is_off", _watch="ArchiveWatch")

__all__ = ["ArchiveWatch", "archive_place", "is_off"]
