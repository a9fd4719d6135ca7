"""Queue the jobs of a running station in the outbox of the archive, as soon as they are saved.

In: a job that is finished, paused or closed. Out: the same in the outbox; the sender delivers it.

See `_watch` (a separate thread; archive and outbox of the settings). It must not know an archive:
measuring does not depend on a server.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_shop.archiving._watch import ArchiveWatch, archive_place, is_off
else:
    __getattr__ = door(__name__)

__all__ = ["ArchiveWatch", "archive_place", "is_off"]
