"""Upload of jobs to the archive: an outbox on each station, and the process that delivers.

In: current job files. Out: each once in the archive, despite kills and power cuts; marks by which
the station holds jobs.

Read `_outbox` (queued jobs, state in words) with `_outbox_file` (durable, with their files),
`_courier` (delivery; marks come back), `_follow` (its process; notes of running jobs, so that none
is lost with a killed program).
It must not know a running station, and measuring never waits for it.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.archive.outbox._courier import (
        BackOff, Courier, Handed, exchange_heads, learn_marks, lost_deliveries, sender_of,
    )  # fmt: skip
    from ocmm_shop.archive.outbox._follow import (
        ArchivePlace, HandOverProcess, JobNote, follow, has_points, main, only_one, sweep,
    )  # fmt: skip
    from ocmm_shop.archive.outbox._outbox import HandOver, Outbox, default_outbox, hand_over
    from ocmm_shop.archive.outbox._outbox_file import (
        ConnectionState, Item, ItemState, machine_identity,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ArchivePlace", "BackOff", "ConnectionState", "Courier", "HandOver", "HandOverProcess",
    "Handed", "Item", "ItemState", "JobNote", "Outbox", "default_outbox", "exchange_heads",
    "follow", "hand_over", "has_points", "learn_marks", "lost_deliveries", "machine_identity",
    "main", "only_one", "sender_of", "sweep",
]  # fmt: skip
