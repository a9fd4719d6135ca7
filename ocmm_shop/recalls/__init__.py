"""Recalls: later findings applied to all archived jobs of all stations.

In: an archive, the histories of the stations' calibrations, a finding. Out: a recall of all
affected jobs; marks in the archive that exclude jobs from statistics and hold them at stations.

Read `_over_archive` (affected jobs and their outcome), `_deciding` (the marks).
It must not know a running station: stations learn by the marks (`archive.learn_marks`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_shop.recalls._deciding import decide_archived, marks_of
    from ocmm_shop.recalls._over_archive import ArchiveFinding, ShopPlaces, recall_archive
else:
    __getattr__ = door(
        __name__,
        _deciding="decide_archived marks_of",
        _over_archive="ArchiveFinding ShopPlaces recall_archive",
    )

__all__ = ["ArchiveFinding", "ShopPlaces", "decide_archived", "marks_of", "recall_archive"]
