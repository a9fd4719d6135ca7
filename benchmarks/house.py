"""How the sources are built, against the goals: public APIs, cycles, names, comments, dead code.

    python -m benchmarks.house [--list] [--root FOLDER]

Reads the files as text and imports nothing of the product. `--list` names what breaks each goal.
Ends with 1 if a goal is missed.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.house_files import read_house
from benchmarks.house_measures import (
    Entry,
    circles,
    classes,
    folders,
    kernels,
    lines,
    longer_than,
    module_graph,
    room_graph,
    single_rooms,
    wrong_entries,
)
from benchmarks.house_tree import ROOTS, House, inside, is_private, upwards
from benchmarks.house_unused import Definition, unused

MOST_FACES = 40
MOST_IN_A_FOLDER = 20
MOST_NAMES_TWICE = 5
LEAST_COMMENTS = 8.0
MOST_LINES = 105_000
LONGEST_FILE = 300


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    measure
        Name of the measure.
    today
        Its value.
    goal
        Its goal; empty if it has none.
    met
        Whether the goal is met.
    listed
        Items that break the goal, or that form the number.
    """

    measure: str
    today: str
    goal: str
    met: bool
    listed: tuple[str, ...] = ()


def main() -> int:
    """Print the table; return 1 if a goal is missed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--list", action="store_true", help="name what breaks each goal")
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[1])
    options = parser.parse_args()
    # All trees are kept to the end: looking for garbage among them takes a third of the time.
    gc.disable()
    rows = table(read_house(options.root))
    width = max(len(row.measure) for row in rows)
    middle = max(len(row.today) for row in rows)
    print(f"{'':3} {'Measure':{width}}  {'Today':{middle}}  Goal")
    for row in rows:
        sign = "" if not row.goal else "ok" if row.met else "NOT"
        print(f"{sign:3} {row.measure:{width}}  {row.today:{middle}}  {row.goal}".rstrip())
    if options.list:
        for row in rows:
            if row.listed:
                print(f"\n{row.measure}: {row.today}")
                print("\n".join(f"  {line}" for line in row.listed))
    return int(any(not row.met for row in rows))


def table(house: House) -> list[Row]:
    """Measure everything."""
    return [
        *_public_apis(house),
        *_folders(house),
        *_circles(house),
        _names(house),
        _comments(house),
        *_unused(house),
        *_sizes(house),
    ]


def _public_apis(house: House) -> list[Row]:
    faceless = [one.module for one in house.packages if one.exported is None]
    with_face = len(house.packages) - len(faceless)
    single = single_rooms(house)
    public = [one.module for one in house.packages if one.exported is not None] + single
    # A package within a package that only that one may import is not public for others.
    public = [name for name in public if not any(is_private(one) for one in upwards(name))]
    rows = [
        Row(
            "Packages with a face", f"{with_face} of {len(house.packages)}", "all", not faceless,
            tuple(f"{name} has no __all__" for name in faceless),
        ),
        Row(
            "Faces: packages, and files at the top", f"{len(public) - len(single)} + {len(single)}",
            f"≤ {MOST_FACES} together", len(public) <= MOST_FACES, tuple(public),
        ),
    ]  # fmt: skip
    entries = wrong_entries(house, house.product.values())
    rows.append(_entered("Modules entered past a face, by the product", entries))
    rows += [
        Row(f"  of {room}", str(count), "0", met=False) for room, count in _by_room(house, entries)
    ]
    for who, sources in (("benchmarks", house.benchmarks), ("tests of other rooms", house.tests)):
        name = f"Modules entered past a face, by {who}"
        rows.append(_entered(name, wrong_entries(house, sources)))
    return rows


def _entered(measure: str, entries: Iterable[Entry]) -> Row:
    ways: defaultdict[str, list[str]] = defaultdict(list)
    names = set()
    for entry in entries:
        ways[entry.taken.target].append(str(entry))
        names.add((entry.taken.target, entry.taken.name))
    return Row(
        measure, f"{len(ways)} ({len(names)} names)", "0", not ways,
        tuple(line for _, those in sorted(ways.items()) for line in those),
    )  # fmt: skip


def _by_room(house: House, entries: Iterable[Entry]) -> list[tuple[str, int]]:
    targets = {entry.taken.target for entry in entries}
    # Sorted before, so that equal counts always come in the same order.
    return Counter(sorted(house.room(target) for target in targets)).most_common()


def _folders(house: House) -> list[Row]:
    counts = folders(house).most_common()
    full = [f"{folder}: {count}" for folder, count in counts if count > MOST_IN_A_FOLDER]
    largest = ", ".join(f"{Path(folder).name} {count}" for folder, count in counts[:4])
    return [
        Row("Files in one folder, the fullest", largest, f"≤ {MOST_IN_A_FOLDER}", not full,
            tuple(full)),
        Row("Folders with more", str(len(full)), "0", not full),
    ]  # fmt: skip


def _circles(house: House) -> list[Row]:
    rows = []
    for what, graph in (("modules", module_graph), ("rooms", room_graph)):
        found = circles(graph(house))
        size = f" (of {', '.join(str(len(one)) for one in found)})" if found else ""
        rows.append(
            Row(f"Circles of {what}", f"{len(found)}{size}", "0", not found,
                tuple(" · ".join(one) for one in found))
        )  # fmt: skip
        more = [one for one in circles(graph(house, typing=True)) if one not in found]
        rows.append(
            Row("  with imports under TYPE_CHECKING", f"{len(more)} more or larger", "", met=True,
                listed=tuple(" · ".join(one) for one in more))
        )  # fmt: skip
    return rows


def _names(house: House) -> Row:
    found = classes(house)
    twice = {name: places for name, places in found.items() if len(places) > 1}
    return Row(
        "Public class names used twice", f"{len(twice)} of {len(found)}", f"≤ {MOST_NAMES_TWICE}",
        len(twice) <= MOST_NAMES_TWICE,
        tuple(f"{name}: {', '.join(places)}" for name, places in sorted(twice.items())),
    )  # fmt: skip


def _comments(house: House) -> Row:
    found = kernels(house)
    code = sum(one.code for one in found)
    mean = 100.0 * sum(one.comments for one in found) / max(1, code)
    return Row(
        f"Comment lines per 100 of code, {len(found)} kernels", f"{mean:.1f}",
        f"≥ {LEAST_COMMENTS:.0f}", not found or mean >= LEAST_COMMENTS,
        tuple(f"{one.path}: {one.per_100:.1f} ({one.comments} of {one.code})" for one in found),
    )  # fmt: skip


def _unused(house: House) -> list[Row]:
    found = unused(house)

    def row(measure: str, those: tuple[Definition, ...]) -> Row:
        size = sum(one.lines for one in those)
        return Row(measure, f"{len(those)} ({size} lines)", "0", not those, tuple(map(str, those)))

    return [
        row("Definitions used by nothing", found.by_anything),
        row("Definitions used by tests only", found.by_tests_only),
    ]


def _sizes(house: House) -> list[Row]:
    rows = []
    total = lines(house.product.values())
    for root in ROOTS:
        own = [one for name, one in house.product.items() if inside(name, root)]
        rows.append(Row(f"Lines of {root}", f"{lines(own)} in {len(own)} files", "", met=True))
    rows.append(
        Row("Lines of both", str(total), f"≤ {MOST_LINES}", total <= MOST_LINES)
    )  # fmt: skip
    for who, sources in (
        ("product", tuple(house.product.values())),
        ("benchmarks and tests", (*house.benchmarks, *house.tests)),
    ):
        long = longer_than(LONGEST_FILE, sources)
        rows.append(
            Row(f"Files above {LONGEST_FILE} lines, {who}", str(len(long)), "0", not long,
                tuple(f"{path}: {count}" for path, count in long))
        )  # fmt: skip
    return rows


if __name__ == "__main__":
    sys.exit(main())
