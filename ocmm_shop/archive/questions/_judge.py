"""Parameters of queries, their answers, and the judgement by the reader's keys.

An answer is a table, remarks, and charts. Judged are the signer of a job, and its valid version.
Rows hold facts. The signature of each row is verified at every reading with the keys trusted here,
and one line of each job counts (`stores._schema`): that of the station whose key signed it, else
the first that came. A version of another station replaces it only if its file continues it.
Signatures by unknown keys are shown as such, and displace nothing.
"""

from __future__ import annotations

import csv
import functools
import importlib.util
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_core.inspection.finished import Trend
from ocmm_core.names import normal_name
from ocmm_core.plugins import install_line
from ocmm_core.seals import KeptKeys, KeyFolder, SealState, SealWord, Signature, shown_key
from ocmm_core.storage import JobFile, judge_head
from ocmm_core.tolerances.decisions import Verdict
from ocmm_shop.archive.records import PART_VERDICTS, VERDICTS, extract_job, is_identity, shown_text
from ocmm_shop.archive.stores import MALFORMED, Archive, Cell, Row, Table, stations_by_key
from ocmm_shop.studies import GaugeStudy

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""Includes wide forms, which spreadsheets in Japanese treat alike."""


@dataclass(frozen=True, slots=True)
class ArchiveAnswer:
    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    """`columns`, `rows`: The table; numbers are numbers, in mm or degrees."""
    notes: tuple[str, ...] = ()
    """Remarks to be known before use, in sentences."""
    trends: tuple[Trend, ...] = ()
    """Charts as on the batch page."""
    study: GaugeStudy | None = None
    """Gauge R&R over stations; None for other queries."""


def export_answer(answer: ArchiveAnswer, path: Path) -> None:
    """Write an answer as CSV or Parquet; InputError: unknown suffix, no pyarrow; StorageError."""
    kind = path.suffix.lower()
    if kind == ".csv":
        content = csv_of(answer.columns, answer.rows)
    elif kind == ".parquet":
        content = parquet_of(answer.columns, answer.rows)
    else:
        raise InputError(
            "archive.export", f"{path}: neither .csv nor .parquet.", "Give it one of these endings."
        )
    try:
        write_atomic(path, content)
    except OSError as error:
        raise StorageError(
            "archive.export",
            f"{path}: the table cannot be written ({error.strerror}).",
            "Choose a folder that is there and that you may write to.",
        ) from error


def csv_of(columns: Sequence[str], rows: Sequence[Row]) -> bytes:
    """Return a table as CSV (RFC 4180, UTF-8): decimal points, formulas escaped."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows([_cell(cell) for cell in row] for row in rows)
    return text.getvalue().encode("utf-8")


def parquet_of(columns: Sequence[str], rows: Sequence[Row]) -> bytes:
    """Return a table as Parquet; InputError if pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        raise InputError(
            "archive.parquet",
            "Parquet needs pyarrow, which is not installed.",
            f"Install it: {install_line('shop')}. Or export to CSV.",
        )
    import pyarrow
    import pyarrow.parquet

    fields = [[shown_cell(row[at]) for row in rows] for at in range(len(columns))]
    table = pyarrow.table(dict(zip(columns, fields, strict=True)))
    sink = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(table, sink)
    return bytes(sink.getvalue())


def shown_cell(cell: Cell) -> Cell:
    """Return a cell for display: its text is untrusted."""
    return shown_text(cell) if isinstance(cell, str) else cell


def _cell(cell: Cell) -> object:
    """Return a cell that spreadsheets read as text, not as a formula."""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, str):
        text = shown_text(cell)
        return f"'{text}" if cell.startswith(_FORMULA) else text
    return "" if cell is None else cell


JUDGED = (
    "job_id, job_uuid, steps, head, sha256, job_key, signature, signer, fault, held, station,"
    " others"
)
"""Columns of `archived_line` and `archived_line_result` that a row needs to be judged."""
_LINES = f"SELECT {JUDGED}, first_id FROM archived_line WHERE job_uuid = :job"  # noqa: S608
_PAGE = 1000

Entry = dict[str, Cell]


def _entries(table: Table) -> Iterator[Entry]:
    """Yield rows by column; those with a value that they cannot have get a fault."""
    for at, row in enumerate(table.rows):
        entry = dict(zip(table.columns, row, strict=True))
        verdict, pair = entry.get("verdict"), (entry.get("value"), entry.get("uncertainty"))
        off = verdict is not None and verdict not in (*VERDICTS, *PART_VERDICTS)
        off |= not is_identity(entry["job_uuid"])
        if at in table.malformed or off or (entry.get("counted") and None in pair):
            entry["fault"] = entry["fault"] or MALFORMED
        yield entry


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
            page = self._archive.query(
                f"{sql} LIMIT :page OFFSET :offset", values | {"page": _PAGE, "offset": offset}
            )
            for row in _entries(page):
                entry = self.judged({name: shown_cell(cell) for name, cell in row.items()})
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
            return judge_head(self._keys, steps, head, Signature(key, signature) if key else None)

        return state

    def _line_of(self, job: str) -> tuple[Cell, int]:
        """Return the valid line of a job, and how many other versions differ from it."""
        if job not in self._taken:
            lines = list(_entries(self._archive.query(_LINES, {"job": job})))
            good = [one for one in lines if not one["fault"] and self.word(one) is SealWord.SEALED]
            taken = min(good or lines, key=self._rank)
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


MOST_SHOWN = 500
"""Newest jobs of a trend: more would be illegible."""
MOST_VALUES = 200_000


@dataclass(frozen=True, slots=True)
class Query:
    """Parameters of a query; each uses some."""

    station: str = ""
    part: str = ""
    characteristic: str = ""
    operator: str = ""
    """`station`, `part`, `characteristic`, `operator`: Names; empty for all."""
    kind: str = "calibration"
    what: str = ""
    """`kind`, `what`: of `used`: calibration, tip, ...; its hash (or prefix), serial or name."""
    first: date | None = None
    last: date | None = None
    """`first`, `last`: Local dates, inclusive; None for no limit (`today`: today)."""
    most: int = MOST_SHOWN
    """Rows of a list, or jobs of a trend."""

    def __post_init__(self) -> None:
        """Normalise names as in the archive."""
        for field in ("station", "part", "characteristic", "operator", "what"):
            object.__setattr__(self, field, normal_name(getattr(self, field)))


def parts(archive: Archive) -> tuple[tuple[str, str], ...]:
    """Return the archived parts and characteristics, sorted."""
    table = archive.query("SELECT part, characteristic FROM archive_characteristic ORDER BY 1, 2")
    return tuple((shown_text(str(part)), shown_text(str(name))) for part, name in table.sound)


def nothing_of(archive: Archive, asked: Query) -> InputError:
    known = parts(archive)
    names = sorted({part for part, _ in known})
    if asked.part not in names:
        some = ", ".join(names[:10]) or "none yet"
        return InputError(
            "archive.part", f"No archived part is called {asked.part!r}.", f"There are: {some}."
        )
    own = ", ".join(name for part, name in known if part == asked.part)[:500]
    return InputError(
        "archive.characteristic",
        f"Part {asked.part} has no counted value of {asked.characteristic or 'anything'!r}"
        f"{at_station(asked.station)}.",
        f"Its characteristics: {own}.",
    )


def needs(asked: Query, *fields: str) -> None:
    labels: Mapping[str, str] = {"what": "what was used"}
    for field in fields:
        if not getattr(asked, field):
            raise InputError(
                "archive.question", f"Which {labels.get(field, field)}?", "Give its name."
            )


def span(first: date, last: date) -> tuple[str, str]:
    """Return the limits of local dates in UTC, as the archive sorts times."""
    if last < first:
        raise InputError(
            "archive.days", f"{last} is before {first}.", "Give the earlier day first."
        )
    low = datetime(first.year, first.month, first.day).astimezone(UTC)
    end = last + timedelta(days=1)
    high = datetime(end.year, end.month, end.day).astimezone(UTC)
    return low.isoformat(timespec="milliseconds"), high.isoformat(timespec="milliseconds")


def wall(utc: Cell) -> str:
    return datetime.fromisoformat(str(utc)).astimezone().strftime("%Y-%m-%d %H:%M")


def remark(entry: Entry) -> str:
    words = [SIMULATED] if entry["simulated"] else []
    words += [f"{entry['requirements']!s}."] if entry["requirements"] else []
    words += [str(entry["doubt"])] if entry["doubt"] else []
    if entry["copies"]:
        words.append(f"Other versions of this job, not shown: {entry['copies']!s}.")
    return " ".join(words)


def part_of(entry: Entry) -> str:
    """Return the identity of a part: its serial number, or its job if none was entered."""
    return f"serial {entry['serial']!s}" if entry["serial"] else f"job {entry['job_uuid']!s}"


def cut(rows: Sequence[object], most: int) -> tuple[str, ...]:
    return (f"Only the first {most} are shown.",) if len(rows) >= most else ()


def at_station(station: str) -> str:
    return f" at {station}" if station else ""


def number_of(cell: Cell) -> float:
    assert isinstance(cell, int | float)  # noqa: S101 - by the type of the column
    return float(cell)
