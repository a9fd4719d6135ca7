"""Jobs of a running station go to the outbox of the archive, as soon as they are saved.

In: a job that is finished, paused or closed. Out: the same in the outbox; the sender does the rest.

Read `_watch` (a thread of its own beside the measuring), `_place` (archive and outbox of the
settings). It must not know an archive: whether a server answers is nobody's business who measures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.station.archiving._place import archive_place, is_off
    from ocmm_core.station.archiving._watch import ArchiveWatch
else:
    __getattr__ = door(__name__, _place="archive_place is_off", _watch="ArchiveWatch")

__all__ = ["ArchiveWatch", "archive_place", "is_off"]
