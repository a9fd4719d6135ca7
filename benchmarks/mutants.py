"""Mutants: whether the tests of a room notice a small mistake in its code.

Places are drawn at random in ten rooms, one small change is made in each (`mutant_sites`), and
the room's own tests run on a copy of the tree until one fails (`mutant_tests`). A mutant is killed
if one does, or if they hang. What survives is printed with its line before and after.

Mutants and outcomes are kept in a file of JSON lines: a run that was cut off goes on where it
stood, and several may share the file once it names the mutants. ``--again`` puts the survivors
before all tests of their room that can see them, as these are now.
"""

from __future__ import annotations

import argparse
import ast
import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.mutant_sites import Change, changes
from benchmarks.mutant_tests import Copy, Room, Seen, chosen, limit

ROOT = Path(__file__).resolve().parents[1]
EACH = 20
KILLED_LIMIT = 0.9
COMPILED_PART = 0.2
"""Largest share of a package's mutants in compiled functions, which take long to build."""
BUDGET_S = 60.0
"""Time of the tests run for a mutant, the quickest of those that ran its lines first."""

_CALIBRATION = "tests/core/calibration/test_"
ROOMS = (
    Room("camera", ("ocmm_core/camera",), ("tests/core/camera",)),
    Room("tracking", ("ocmm_core/tracking",), ("tests/core/tracking",)),
    Room("measuring", ("ocmm_core/measuring",), ("tests/core/measuring",)),
    Room(
        "features",
        ("ocmm_core/features/elements", "ocmm_core/features/search"),
        ("tests/core/features",),
    ),
    Room("alignment", ("ocmm_core/alignment",), ("tests/core/alignment",)),
    Room(
        "tolerances",
        ("ocmm_core/tolerances/kinds", "ocmm_core/tolerances/decisions"),
        ("tests/core/tolerances",),
    ),
    Room("evaluation", ("ocmm_core/inspection/evaluation",), ("tests/core/inspection",)),
    Room(
        "calibration",
        ("ocmm_core/calibration/bundle", "ocmm_core/calibration/pivot"),
        tuple(
            f"{_CALIBRATION}{name}.py"
            for name in ("bundle", "pivot", "pivot_pattern", "pivot_poses", "relocation")
        ),
    ),
    Room(
        "fieldbus",
        ("ocmm_core/fieldbus/wire", "ocmm_core/fieldbus/report"),
        ("tests/core/fieldbus",),
    ),
    Room("export", ("ocmm_core/export",), ("tests/core/export",)),
)


@dataclass(frozen=True, slots=True)
class Mutant:
    """One drawn change: whole lines of a file, before and after.

    Attributes
    ----------
    number
        In the file of the results.
    room, file, line
        Where.
    kind, names, compiled
        As `Change` has them.
    old, new
        The lines.
    """

    number: int
    room: str
    file: str
    line: int
    kind: str
    old: str
    new: str
    names: tuple[str, ...]
    compiled: bool

    def change(self, source: str) -> Change | None:
        """Return the change in a file as it is now; none if its lines are gone."""
        lines, old = source.splitlines(), self.old.split("\n")
        found = [
            line
            for line in range(1, len(lines) - len(old) + 2)
            if lines[line - 1 : line - 1 + len(old)] == old
        ]
        if not found:
            return None
        line = min(found, key=lambda one: abs(one - self.line))
        end = (line + len(old) - 1, len(old[-1]))
        return Change(self.kind, (line, 0), end, self.new, self.names, self.compiled)


@dataclass(frozen=True, slots=True)
class Judgement:
    """Outcome of the tests of a mutant: killed, timeout, survived, not covered, or gone."""

    judged: int
    outcome: str
    tests: int
    by: str
    seconds: float


def draw(room: Room, texts: dict[str, str], n: int, rng: np.random.Generator) -> list[Mutant]:
    """Return ``n`` mutants of a room's modules, every place at most once."""
    places: dict[tuple[Any, ...], list[Change]] = {}
    for file, text in texts.items():
        for change in changes(text):
            places.setdefault((file, change.begin, change.end), []).append(change)
    order = list(places)
    rng.shuffle(order)
    drawn: list[Mutant] = []
    for place in order:
        file = place[0]
        change = places[place][rng.integers(len(places[place]))]
        if change.compiled and sum(one.compiled for one in drawn) >= COMPILED_PART * n:
            continue
        if len(drawn) < n and _compiles(change.applied(texts[file])):
            drawn.append(_mutant(room, file, change, texts[file]))
    return drawn


def _mutant(room: Room, file: str, change: Change, text: str) -> Mutant:
    first, last = change.begin[0], change.end[0]
    lines, changed = text.splitlines(), change.applied(text).splitlines()
    more = len(changed) - len(lines)
    return Mutant(
        0,
        room.name,
        file,
        first,
        change.kind,
        "\n".join(lines[first - 1 : last]),
        "\n".join(changed[first - 1 : last + more]),
        change.names,
        change.compiled,
    )


def _compiles(text: str) -> bool:
    try:
        ast.parse(text)
    except SyntaxError:
        return False
    return True


class Book:
    """The file of the results."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.seed: int | None = None
        self.mutants: dict[int, Mutant] = {}
        self.judged: dict[int, Judgement] = {}
        for line in path.read_text("utf-8").splitlines() if path.exists() else ():
            entry = json.loads(line)
            if "seed" in entry:
                self.seed = entry["seed"]
            elif "judged" in entry:
                self.judged[entry["judged"]] = Judgement(**entry)
            else:
                entry["names"] = tuple(entry["names"])
                self.mutants[entry["number"]] = Mutant(**entry)

    def begin(self, seed: int) -> None:
        """Record the seed of the drawing."""
        self.seed = seed
        self._write({"seed": seed})

    def add(self, drawn: list[Mutant]) -> None:
        """Give the mutants their numbers and note them."""
        for mutant in drawn:
            entry = asdict(mutant) | {"number": len(self.mutants)}
            self.mutants[len(self.mutants)] = Mutant(**entry)
            self._write(entry)

    def note(self, judgement: Judgement) -> None:
        """Note an outcome; the last one of a mutant counts."""
        self.judged[judgement.judged] = judgement
        self._write(asdict(judgement))

    def _write(self, entry: dict[str, Any]) -> None:
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")


def judge(copy: Copy, mutant: Mutant, seen: dict[str, Seen], budget_s: float) -> Judgement:
    """Return the outcome of a mutant; without a budget, of all tests of the package."""
    begin = time.monotonic()
    change = mutant.change(copy.texts.get(mutant.file, ""))
    if change is None:
        return Judgement(mutant.number, "gone", 0, "", 0.0)
    tests, covered = chosen(copy, mutant.file, change, seen, budget_s)
    if not covered:
        return Judgement(mutant.number, "not covered", 0, "", 0.0)
    outcome = copy.judge(mutant.file, change, tests, limit(tests, seen, change.compiled))
    by = copy.first_failure() if outcome == "killed" else ""
    seconds = round(time.monotonic() - begin, 1)
    return Judgement(mutant.number, outcome, len(tests), by, seconds)


def run(rooms: list[Room], book: Book, n: int, again: bool, budget_s: float, notes: Path) -> None:
    """Judge new mutants, or survivors, of packages in a new copy of the tree."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(ROOT, Path(folder))
        for room in ROOMS if not book.mutants else ():
            rng = np.random.default_rng([book.seed or 0, *room.name.encode()])
            book.add(draw(room, {f: copy.texts[f] for f in copy.files(room)}, n, rng))
        for room in rooms:
            wanted = [one for one in book.mutants.values() if one.room == room.name]
            if again:
                left = {n for n, one in book.judged.items() if one.outcome[0] not in "kt"}
                wanted = [one for one in wanted if one.number in left]
            else:
                wanted = [one for one in wanted if one.number not in book.judged]
            if not wanted:
                continue
            print(f"{room.name}: {len(wanted)} mutants", flush=True)
            seen = copy.seen(room, notes.with_suffix(f".{room.name}.json"))
            # In another order each time: several runs may share a file.
            for at in np.random.default_rng().permutation(len(wanted)):
                mutant = wanted[at]
                if not again and mutant.number in Book(notes).judged:
                    continue
                judgement = judge(copy, mutant, seen, budget_s)
                book.note(judgement)
                where = f"{mutant.file}:{mutant.line}"
                print(f"{judgement.outcome:<12}{judgement.seconds:7.1f} s  {where}", flush=True)


def table(book: Book) -> tuple[list[str], float]:
    """Return the table with the survivors below, and the part that was killed."""
    kinds = ("killed", "timeout", "survived", "not covered")
    lines = [f"{'room':<14}{'mutants':>8}" + "".join(f"{kind:>13}" for kind in kinds)]
    outcomes: dict[str, list[str]] = {}
    for number, mutant in book.mutants.items():
        if number in book.judged:
            outcomes.setdefault(mutant.room, []).append(book.judged[number].outcome)
    every = [one for room in outcomes.values() for one in room]
    for name, row in (*outcomes.items(), ("all", every)):
        counts = "".join(f"{row.count(kind):>13}" for kind in kinds)
        lines.append(f"{name:<14}{len(row):>8}{counts}")
    for number, one in sorted(book.judged.items()):
        if one.outcome not in ("killed", "timeout"):
            mutant = book.mutants[number]
            lines += ["", f"{one.outcome}: {mutant.file}:{mutant.line} ({mutant.kind})"]
            lines += [f"  - {line.strip()}" for line in mutant.old.split("\n")]
            lines += [f"  + {line.strip()}" for line in mutant.new.split("\n")]
    killed = sum(one in ("killed", "timeout") for one in every)
    return lines, killed / max(len(every), 1)


def main() -> int:
    """Print the table; 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, help="file of JSON lines; a run goes on from it")
    parser.add_argument("--n", type=int, default=EACH, help="mutants a room")
    parser.add_argument("--seed", type=int, help="drawn, if it is not given")
    parser.add_argument("--rooms", nargs="+", choices=[room.name for room in ROOMS])
    parser.add_argument("--again", action="store_true", help="judge the survivors once more")
    parser.add_argument("--budget", type=float, help="seconds of tests for a mutant")
    arguments = parser.parse_args()
    book = Book(arguments.results)
    if book.seed is None:
        book.begin(arguments.seed or int(np.random.SeedSequence().generate_state(1)[0]))
    print(f"seed {book.seed}")
    rooms = [room for room in ROOMS if arguments.rooms is None or room.name in arguments.rooms]
    budget = arguments.budget or (np.inf if arguments.again else BUDGET_S)
    run(rooms, book, arguments.n, arguments.again, budget, arguments.results)
    lines, killed = table(book)
    print("\n".join(lines))
    print(f"\nkilled {100 * killed:.1f} %   (limit {100 * KILLED_LIMIT:g} %)")
    return int(killed < KILLED_LIMIT)


if __name__ == "__main__":
    sys.exit(main())
