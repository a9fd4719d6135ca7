"""Parameters of queries, and words common to all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import SIMULATED
from ocmm_core.names import normal_name
from ocmm_shop.archive.questions._judge import Entry
from ocmm_shop.archive.records import shown_text
from ocmm_shop.archive.stores import Archive, Cell

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
    table = archive.ask("SELECT part, characteristic FROM archive_characteristic ORDER BY 1, 2")
    return tuple((shown_text(str(part)), shown_text(str(name))) for part, name in table.rows)


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
