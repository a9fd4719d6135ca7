"""Upload of jobs to the archive: an outbox on each station, and the process that delivers.

In: current job files. Out: each once in the archive, despite kills and power cuts; marks by which
the station holds jobs.

Read `_outbox` with `_outbox_file` and `_outbox_rows` (durable, with their files), `_notes` (running
jobs, so that none is lost with a killed program), `_courier` (delivery), `_learn` (marks come
back), `_follow` (the process of both), `_status` (state in words).
It must not know a running station, and measuring never waits for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_shop.archive.outbox._courier import (
        BackOff,
        Courier,
        Handed,
        lost_deliveries,
        sender_of,
    )
    from ocmm_shop.archive.outbox._follow import (
        ArchivePlace,
        HandOverProcess,
        follow,
        main,
        only_one,
    )
    from ocmm_shop.archive.outbox._learn import exchange_heads, learn_marks
    from ocmm_shop.archive.outbox._notes import JobNote, has_points, sweep
    from ocmm_shop.archive.outbox._outbox import Outbox, default_outbox
    from ocmm_shop.archive.outbox._outbox_rows import (
        ConnectionState,
        Item,
        ItemState,
        machine_identity,
    )
    from ocmm_shop.archive.outbox._status import HandOver, hand_over
else:
    __getattr__ = door(
        __name__,
        _courier="BackOff Courier Handed lost_deliveries sender_of",
        _follow="ArchivePlace HandOverProcess follow main only_one",
        _learn="exchange_heads learn_marks",
        _notes="JobNote has_points sweep",
        _outbox="Outbox default_outbox",
        _outbox_rows="ConnectionState Item ItemState machine_identity",
        _status="HandOver hand_over",
    )

__all__ = [
    "ArchivePlace", "BackOff", "ConnectionState", "Courier", "HandOver", "HandOverProcess",
    "Handed", "Item", "ItemState", "JobNote", "Outbox", "default_outbox", "exchange_heads",
    "follow", "hand_over", "has_points", "learn_marks", "lost_deliveries", "machine_identity",
    "main", "only_one", "sender_of", "sweep",
]  # fmt: skip
