"""What the process beside the window does for a recall: compute it, and store it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

from ocmm_core.archive.stores import open_archive
from ocmm_core.inspection.archive import RecallRecord
from ocmm_core.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive
from ocmm_gui.kit import later
from ocmm_gui.work import Teller


@dataclass(frozen=True, slots=True)
class Recalling:
    """Recall the archived jobs that a finding touches; nothing is changed by it."""

    places: ShopPlaces
    finding: ArchiveFinding | None

    def __call__(self, tell: Teller) -> RecallRecord:
        """Return the recall; errors as those of `recall_archive`."""
        return recall_archive(self.places, datetime.now(UTC), tell, finding=self.finding)


@dataclass(frozen=True, slots=True)
class Storing:
    """Store a recall with its marks, in somebody's name."""

    places: ShopPlaces
    record: RecallRecord
    who: str

    def __call__(self, tell: Teller) -> RecallRecord:
        """Return the recall as it was stored; errors as those of `decide_archived`."""
        tell(later("Storing the recall"), 0.5)
        with open_archive(self.places.address, password=self.places.password) as archive:
            tell.commit()
            return decide_archived(archive, self.record, self.who, datetime.now(UTC))[0]
