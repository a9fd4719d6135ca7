"""The tool that changes sources: its changes, and the distinction of killed and survived."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks import mutant_trace
from benchmarks.mutant_sites import Change, changes
from benchmarks.mutant_tests import Copy, Room, Seen, chosen, limit
from benchmarks.mutants import Book, Judgement, Mutant, draw, judge, table

SMALL = '''
"""Text 7."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from numbers import Number
__all__ = ["LIMIT", "area", "kind", "never"]
LIMIT = 2.5


def area(a: float, b: float) -> float:
    """Return 3."""
    return a * b


def kind(x: float, which: Literal[1, 2] = 1) -> str:
    if x < 0.0 and which == 1:
        raise ValueError(f"{x + 1} is below {0}")
    return "large" if x >= LIMIT else "small"


def never() -> int:
    return 4
'''
TESTS = """
from ocmm_core.small import area, kind

def test_area():
    assert area(2.0, 3.0) == 6.0

def test_kind():
    assert kind(1.0) == "small"
    assert kind(3.0) == "large"
"""
ROOM = Room("small", ("ocmm_core",), ("tests",))
FILE = "ocmm_core/small.py"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    """Return a copy of a small tree."""
    folder = tmp_path_factory.mktemp("small")
    source = folder / "source"
    for name in ("ocmm_core", "tests", "benchmarks"):
        (source / name).mkdir(parents=True)
    (source / "pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["timing"]\n')
    (source / FILE).write_text(SMALL)
    (source / "tests" / "test_small.py").write_text(TESTS)
    shutil.copy2(mutant_trace.__file__, source / "benchmarks")
    (folder / "copies").mkdir()
    return Copy(source, folder / "copies")


@pytest.fixture(scope="module")
def seen(copy: Copy, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Seen]:
    """Return the tests' runs on the small tree, read back from the store."""
    memory = tmp_path_factory.mktemp("memory") / "memory.json"
    first = copy.seen(ROOM, memory)
    again = copy.seen(ROOM, memory)
    assert again == first
    return again


def written(change: Change, source: str = SMALL) -> tuple[str, str]:
    """Return the changed line, before and after."""
    line = change.begin[0] - 1
    return source.splitlines()[line].strip(), change.applied(source).splitlines()[line].strip()


def mutant(old: str, new: str) -> Mutant:
    """Return the one mutant of the small module that makes one line of another."""
    copied = {FILE: SMALL}
    drawn = [
        one
        for seed in range(40)
        for one in draw(ROOM, copied, 10, np.random.default_rng(seed))
        if (one.old.strip(), one.new.strip()) == (old, new)
    ]
    return drawn[0]


def test_only_what_is_computed_with_is_changed() -> None:
    found = [written(change) for change in changes(SMALL)]
    assert ("return a * b", "return a / b") in found
    assert ("return a * b", "return None") in found
    assert ("if x < 0.0 and which == 1:", "if x < 0.0 or which == 1:") in found
    assert ("if x < 0.0 and which == 1:", "if x >= 0.0 and which == 1:") in found
    assert ("if x < 0.0 and which == 1:", "if (not (x < 0.0 and which == 1)):") in found
    assert ("LIMIT = 2.5", "LIMIT = 5.0") in found
    old = {before for before, _ in found}
    kept = ('"""Text 7."""', '"""Return 3."""', "if TYPE_CHECKING:", "__all__")
    assert not any(line.startswith(("raise", "from", *kept)) for line in old)
    signatures = [after for before, after in found if before.startswith("def kind")]
    assert len(signatures) == 2  # the default, one up and one down; not what Literal allows
    assert all("Literal[1, 2]" in line for line in signatures)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("y = -x", {"y = x"}),
        ("y = not (x)", {"y =  (x)", "y = (x)"}),
        ("y = a if b is not None else c", {"y = a if b is None else c"}),
        ("y = a not in b", {"y = a in b"}),
        ("y = (a) + (b)", {"y = (a) - (b)"}),
        ("y = 'ä' * a - b", {"y = 'ä' * a + b"}),
        ("y += x", {"y -= x"}),
        ("y = True", {"y = False"}),
        ("y = 500", {"y = 1000"}),
        ("def f(): return a, b", {"def f(): return b, a", "def f(): return None"}),
        ("def f(): return g(a, b=c)", {"def f(): return g(a, b=None)"}),
        ("y = 'a' + b", set()),
        ("y = f'{a + 1}'", set()),
        ("zip(a, b, strict=True)", set()),
        ("_log.info('%d', 1)", set()),
        ("assert x == 1", set()),
        ("@dataclass(frozen=True)\nclass A: ...", set()),
    ],
)
def test_each_kind_of_change(source: str, expected: set[str]) -> None:
    found = {change.applied(source) for change in changes(source)}
    assert found & expected if expected else not found


def test_every_mutant_that_is_drawn_can_be_read() -> None:
    root = Path(__file__).resolve().parents[2]
    texts = {
        str(path): path.read_text("utf-8")
        for path in sorted((root / "ocmm_core" / "measuring").glob("_*.py"))
        if path.name != "__init__.py"
    }
    drawn = draw(ROOM, texts, 40, np.random.default_rng(1))
    assert len(drawn) == len({(one.file, one.line, one.new) for one in drawn}) == 40
    for one in drawn:
        change = one.change(texts[one.file])
        assert change is not None
        changed = change.applied(texts[one.file])
        ast.parse(changed)
        assert changed != texts[one.file]


def test_at_most_a_part_is_drawn_in_compiled_functions() -> None:
    kernel = "@compiled()\ndef f(a, b):\n    return a + b * 2.0 - 3.0 / 4.0 + a * b\n"
    drawn = draw(ROOM, {"a.py": kernel, "b.py": SMALL}, 10, np.random.default_rng(2))
    assert sum(one.compiled for one in drawn) == 2
    assert len(drawn) == 10


@pytest.mark.slow
def test_killed_survived_and_not_covered_are_told_apart(
    copy: Copy, seen: dict[str, Seen], tmp_path: Path
) -> None:
    before = copy.texts[FILE]
    assert {name.split("::")[1] for name in seen} == {"test_area", "test_kind"}
    book = Book(tmp_path / "book.jsonl")
    book.begin(5)
    book.add(
        [
            mutant("return a * b", "return a / b"),
            mutant(
                'return "large" if x >= LIMIT else "small"',
                'return "large" if x > LIMIT else "small"',
            ),
            mutant("return 4", "return 5"),
            mutant("LIMIT = 2.5", "LIMIT = 5.0"),
        ]
    )
    for one in book.mutants.values():
        book.note(judge(copy, one, seen, np.inf))
    outcomes = [book.judged[number].outcome for number in range(4)]
    assert outcomes == ["killed", "survived", "not covered", "killed"]
    assert book.judged[0].by == "tests/test_small.py::test_area"
    assert (copy.root / FILE).read_text("utf-8") == before
    again = Book(tmp_path / "book.jsonl")
    assert (again.seed, again.mutants, again.judged) == (5, book.mutants, book.judged)
    lines, killed = table(again)
    assert killed == pytest.approx(0.5)
    assert "  - return 4" in lines


def test_a_mutant_that_hangs_is_ended(copy: Copy) -> None:
    change = Change("number", (16, 4), (16, 16), "while True: pass", (), False)
    assert copy.judge(FILE, change, ["tests/test_small.py"], 3.0) == "timeout"


def test_a_mutant_whose_lines_are_gone_is_not_judged(copy: Copy) -> None:
    gone = Mutant(0, "small", FILE, 3, "number", "x = 1", "x = 2", (), False)
    assert judge(copy, gone, {}, 1.0) == Judgement(0, "gone", 0, "", 0.0)


def test_tests_near_the_change_come_first(copy: Copy, seen: dict[str, Seen]) -> None:
    line = SMALL.splitlines().index("LIMIT = 2.5") + 1
    change = next(one for one in changes(SMALL) if one.begin[0] == line)
    tests, covered = chosen(copy, FILE, change, seen, np.inf)
    assert covered
    assert tests == ["tests/test_small.py::test_kind", "tests/test_small.py::test_area"]
    assert 30.0 < limit(tests, seen, False) < limit(tests, seen, True)
