"""Judgement by the reader's keys: which version of a job is valid, and who signed it.

Rows hold facts. The signature of each row is verified at every reading with the keys trusted here,
and one line of each job counts (`stores._views`): that of the station whose key signed it, else the
first that came. A version of another station replaces it only if its file continues it. Signatures
by unknown keys are shown as such, and displace nothing.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path

from ocmm_core.errors import OcmmError
from ocmm_core.seals import KeptKeys, KeyFolder, SealState, SealWord, Signature, shown_key
from ocmm_core.storage import JobFile, judge_head
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.archive.questions._answers import shown_cell
from ocmm_shop.archive.records import extract_job
from ocmm_shop.archive.stores import Archive, Cell, stations_by_key

JUDGED = (
    "job_id, job_uuid, steps, head, sha256, job_key, signature, signer, fault, held, station,"
    " others"
)
"""Columns of `archived_line` and `archived_line_result` that a row needs to be judged."""
_LINES = f"SELECT {JUDGED}, first_id FROM archived_line WHERE job_uuid = :job"  # noqa: S608
_PAGE = 1000

Entry = dict[str, Cell]


class Judge:
    """Judge rows of an archive, for one reading. `keys`: trusted ones; None: those of this user."""

    def __init__(self, archive: Archive, keys: KeyFolder | None = None) -> None:
        self._archive = archive
        # Read once: a query judges thousands of rows.
        self._keys = KeptKeys(None if keys is None else keys.folder)
        self._taken: dict[str, tuple[Cell, int]] = {}
        self._checked: dict[int, bool] = {}
        self._stations: dict[str, set[str]] | None = None

    def rows(
        self, sql: str, values: dict[str, Cell], most: int, keep: Callable[[Entry], bool]
    ) -> Iterator[Entry]:
        """Yield judged rows, page by page, until ``most`` of them were kept.

        `sql` selects `JUDGED` in addition to its own columns, and sorts. `keep`: whether a row
        counts for ``most``; all are yielded.
        """
        kept = offset = 0
        while True:
            page = self._archive.ask(
                f"{sql} LIMIT :page OFFSET :offset", values | {"page": _PAGE, "offset": offset}
            )
            for row in page.rows:
                cells = (shown_cell(cell) for cell in row)
                entry = self.judged(dict(zip(page.columns, cells, strict=True)))
                if entry is None:
                    continue
                kept += keep(entry)
                yield entry
                if kept >= most:
                    return
            offset += _PAGE
            if len(page.rows) < _PAGE:
                return

    def judged(self, row: Entry) -> Entry | None:
        """Return a row with ``doubt``, ``copies`` and station; None if another line counts."""
        copies = 0
        if row["others"]:
            taken, copies = self._line_of(str(row["job_uuid"]))
            if taken != row["job_id"]:
                return None
        word = self.word(row)
        doubt = str(row["fault"])
        if not doubt and word is not SealWord.SEALED:
            doubt = {
                SealWord.UNKNOWN_KEY: "Signed by a key that is unknown here "
                f"({shown_key(str(row['signer']))}).",
                SealWord.NOT_SIGNED: "Not signed.",
            }.get(word, "The signature does not belong to this row.")
        proven = self._stations_of(str(row["job_key"]))
        station = row["station"]
        if not doubt and proven and station not in proven:
            if self._is_of_its_file(row):
                station = min(proven)
            else:
                doubt = "Sent by another station than the one that signed it, and not as its file."
        if not doubt and row["held"]:
            doubt = "Held back: see the marks."
        found = row | {"doubt": doubt, "copies": copies, "station": station}
        if doubt:
            found |= {"counted": 0, "why_not": doubt}
            if "verdict" in row:
                found["verdict"] = Verdict.NOT_PROVEN.value
        return found

    def word(self, row: Entry) -> SealWord:
        """Return the state of the signature of a row by the keys trusted here."""
        state = self._head(
            int(str(row["steps"])), str(row["head"]), str(row["job_key"]), str(row["signature"])
        )
        forged = state.fingerprint != row["signer"]
        return SealWord.FORGED if forged and row["signer"] else state.word

    @functools.cached_property
    def _head(self) -> Callable[[int, str, str, str], SealState]:
        @functools.lru_cache(100_000)
        def state(steps: int, head: str, key: str, signature: str) -> SealState:
            signed = Signature(key, signature) if key else None
            return judge_head(self._keys, steps, head, signed)

        return state

    def _line_of(self, job: str) -> tuple[Cell, int]:
        """Return the valid line of a job, and how many other versions differ from it."""
        if job not in self._taken:
            table = self._archive.ask(_LINES, {"job": job})
            lines = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
            good = [one for one in lines if not one["fault"] and self.word(one) is SealWord.SEALED]
            ranked = sorted(good or lines, key=self._rank)
            taken = ranked[0]
            for one in sorted(good, key=lambda line: int(str(line["steps"]))):
                if self._continues(one, taken):
                    taken = one
            # An identical file from another station is no other version.
            same = sum(one["sha256"] == taken["sha256"] for one in lines if one is not taken)
            self._taken[job] = taken["job_id"], int(str(taken["others"])) - same
        return self._taken[job]

    def _rank(self, line: Entry) -> tuple[bool, bool, int]:
        own = str(line["station"]) in self._stations_of(str(line["job_key"]))
        return bool(line["fault"]), not own, int(str(line["first_id"]))

    def _continues(self, later: Entry, earlier: Entry) -> bool:
        """Return whether the file of a version continues another one; False if unreadable."""
        if int(str(later["steps"])) <= int(str(earlier["steps"])):
            return False
        try:
            content = self._archive.content(str(later["sha256"]))
            with JobFile.in_memory(Path("job.ocmm"), content) as file:
                same = file.head.job_uuid == earlier["job_uuid"]
                return same and file.links().get(int(str(earlier["steps"]))) == earlier["head"]
        except OcmmError:
            return False

    def _is_of_its_file(self, row: Entry) -> bool:
        """Return whether all rows of a job follow from its file; False if unreadable.

        The signature of a head does not cover its row: another station could write any.
        """
        number = int(str(row["job_id"]))
        if number not in self._checked:
            try:
                stored = self._archive.record(number)
                content = self._archive.content(stored.job.sha256)
                made = extract_job(content, "job.ocmm", stored.job.station)
                self._checked[number] = made.record == stored
            except OcmmError:
                self._checked[number] = False
        return self._checked[number]

    def _stations_of(self, key: str) -> set[str]:
        if self._stations is None:
            self._stations = stations_by_key(self._archive)
        return self._stations.get(key, set())
