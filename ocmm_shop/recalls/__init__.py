"""Recalls: later findings applied to all archived jobs of all stations.

In: an archive, the histories of the stations' calibrations, a finding. Out: a recall of all
affected jobs; marks in the archive that exclude jobs from statistics and hold them at stations.

See `_over_archive` (affected jobs and their outcome, the marks).
It must not know a running station: stations learn by the marks (`archive.learn_marks`).
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_shop.recalls._over_archive import (
        ArchiveFinding, ShopPlaces, decide_archived, marks_of, recall_archive,
    )  # fmt: skip
else:
    __getattr__ = door(__name__)

__all__ = ["ArchiveFinding", "ShopPlaces", "decide_archived", "marks_of", "recall_archive"]
