"""The measures of the sources, on a small tree with every way to be right or wrong."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from benchmarks.house import table
from benchmarks.house_files import read_house
from benchmarks.house_measures import (
    circles,
    classes,
    folders,
    kernels,
    longer_than,
    module_graph,
    room_graph,
    single_rooms,
    wrong_entries,
)
from benchmarks.house_tree import House
from benchmarks.house_unused import unused

FILES = {
    "pyproject.toml": """
        [project.scripts]
        ocmm = "ocmm_cli:main"
        """,
    "ocmm_core/__init__.py": "__version__ = '1'",
    "ocmm_core/errors.py": "class OcmmError(Exception): ...",
    "ocmm_cli/__init__.py": """
        from ocmm_core.calibration.pivot import solve
        __all__ = ["main"]
        def main(): solve(); OcmmError
        """,
    "ocmm_core/calibration/__init__.py": "",
    "ocmm_core/calibration/_shared.py": "from ocmm_core.calibration.pivot import Pivot",
    "ocmm_core/calibration/pivot/__init__.py": """
        from importlib import import_module
        from typing import TYPE_CHECKING

        if TYPE_CHECKING:
            from ocmm_core.calibration.pivot._solve import Pivot, never, solve

        __all__ = ["Pivot", "never", "solve"]
        _HOMES = {"Pivot": "_solve", "solve": "_solve", "never": "_solve"}

        def __getattr__(name):
            return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
        """,
    "ocmm_core/calibration/pivot/_solve.py": """
        from ocmm_core.calibration.pivot._kernel import loop
        from ocmm_core.errors import OcmmError

        class Pivot:
            def used(self): return self.used_too()
            def used_too(self): raise OcmmError
            def lonely(self): return self.lonely()

        def solve(): return Pivot().used() + loop()
        def never(): return _only_never()
        def _only_never(): return 1
        def hook(): return 2
        """,
    "ocmm_core/calibration/pivot/_kernel.py": '''
        from ocmm_core.compiling import quick

        @quick()
        def loop():
            """Turn."""
            # Against the clock.
            x = 1  # noqa: E741
            y = """
            # text
            """
            return x + y  # mm
        ''',
    "ocmm_core/compiling.py": """
        import numba
        def quick(): return numba.njit(cache=True)
        """,
    "ocmm_core/tip/__init__.py": """
        from ocmm_core.tip._tip import Pivot
        __all__ = ["Pivot"]
        """,
    "ocmm_core/tip/_tip.py": """
        from ocmm_core.probe import length
        class Pivot: ...
        """,
    "ocmm_core/probe/__init__.py": """
        from typing import TYPE_CHECKING
        if TYPE_CHECKING:
            from ocmm_core.probe._length import length
        __all__ = ["length"]
        """,
    "ocmm_core/probe/_length.py": """
        from ocmm_core.tip import Pivot
        def length(): return Pivot
        """,
    "ocmm_gui/__init__.py": "",
    "tests/core/calibration/pivot/test_solve.py": """
        from ocmm_core.calibration.pivot._solve import hook
        """,
    "tests/core/calibration/test_all.py": """
        from ocmm_core.calibration.pivot._kernel import loop
        """,
    "tests/core/tip/test_other_room.py": """
        from ocmm_core.calibration.pivot._kernel import loop
        """,
}


def house_with(folder: Path, **more: str) -> House:
    """Return the small tree with more files; ``a__b`` is the file ``a/b.py``."""
    added = {f"{name.replace('__', '/')}.py": text for name, text in more.items()}
    for name, text in {**FILES, **added}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(text))
    return read_house(folder)


def entries_of(house: House, module: str) -> list[str]:
    return [entry.reason for entry in wrong_entries(house, [house.product[module]])]


def test_of_the_small_tree_only_one_package_lacks_a_face(tmp_path: Path) -> None:
    house = house_with(tmp_path)
    assert [one.module for one in house.packages if one.exported is None] == [
        "ocmm_core.calibration"
    ]
    assert single_rooms(house) == ["ocmm_core.compiling", "ocmm_core.errors"]
    assert wrong_entries(house, house.product.values()) == []


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("from ocmm_core.calibration.pivot import solve, Pivot", ""),
        ("from ocmm_core.errors import OcmmError", ""),
        ("from ocmm_core import __version__, errors", ""),
        ("from ocmm_core.calibration.pivot._solve import solve", "past the face"),
        ("from ocmm_core.calibration.pivot import _solve", "past the face"),
        ("import ocmm_core.calibration.pivot._solve as inner", "past the face"),
        ("def f():\n    from ocmm_core.calibration._shared import Pivot", "past the face"),
        ("import importlib\nimportlib.import_module('ocmm_core.tip._tip')", "past the face"),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n"
         "    from ocmm_core.tip._tip import Pivot", "past the face"),
        ("from ocmm_core.calibration.pivot import hook", "not in __all__"),
        ("from ocmm_core.calibration import pivot", "the room as a module"),
        ("import ocmm_core.calibration.pivot", "the room as a module"),
        ("from ocmm_core.calibration import anything", "no face there"),
    ],
)  # fmt: skip
def test_a_room_is_entered_by_names_of_its_face_alone(
    statement: str, reason: str, tmp_path: Path
) -> None:
    house = house_with(tmp_path, ocmm_gui__window=statement)
    assert entries_of(house, "ocmm_gui.window") == ([reason] if reason else [])


def test_files_of_one_room_and_of_rooms_in_it_see_each_other(tmp_path: Path) -> None:
    taken = "from ocmm_core.calibration.pivot._solve import solve"
    shared = "from ocmm_core.calibration._shared import Pivot"
    house = house_with(
        tmp_path,
        ocmm_core__calibration__pivot___more=f"{taken}\n{shared}",
        ocmm_core__calibration___beside=taken,
    )
    assert entries_of(house, "ocmm_core.calibration.pivot._more") == []
    assert entries_of(house, "ocmm_core.calibration._beside") == ["past the face"]


def test_a_name_that_begins_alike_is_another_room(tmp_path: Path) -> None:
    house = house_with(tmp_path, ocmm_core__tips="from ocmm_core.tip._tip import Pivot")
    assert entries_of(house, "ocmm_core.tips") == ["past the face"]


def test_a_private_room_is_open_to_the_package_around_it_alone(tmp_path: Path) -> None:
    taken = "from ocmm_core.tip._ball import size"
    (tmp_path / "ocmm_core" / "tip" / "_ball").mkdir(parents=True)
    (tmp_path / "ocmm_core" / "tip" / "_ball" / "__init__.py").write_text(
        "__all__ = ['size']\nsize = 1"
    )
    house = house_with(tmp_path, ocmm_gui__window=taken, ocmm_core__tip___more=taken)
    assert entries_of(house, "ocmm_core.tip._more") == []
    assert entries_of(house, "ocmm_gui.window") == ["a private room"]


def test_tests_enter_their_own_room_and_no_other(tmp_path: Path) -> None:
    house = house_with(tmp_path)
    found = wrong_entries(house, house.tests)
    assert [(entry.source.path.name, entry.reason) for entry in found] == [
        ("test_other_room.py", "past the face")
    ]


def test_circles_are_seen_through_lazy_faces_and_without_what_only_types_need(
    tmp_path: Path,
) -> None:
    house = house_with(
        tmp_path,
        ocmm_core__a="from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n"
        "    from ocmm_core.b import x",
        ocmm_core__b="from ocmm_core.a import y",
    )
    through_faces = [["ocmm_core.probe._length", "ocmm_core.tip", "ocmm_core.tip._tip"]]
    assert circles(module_graph(house)) == through_faces
    assert circles(room_graph(house)) == [["ocmm_core.probe", "ocmm_core.tip"]]
    assert ["ocmm_core.a", "ocmm_core.b"] in circles(module_graph(house, typing=True))


def test_circles_are_the_strongly_connected_parts() -> None:
    arrows = {"a": "b", "b": "ce", "c": "a", "d": "e", "e": "f", "f": "d", "g": "ag", "h": ""}
    graph = {name: frozenset(needs) for name, needs in arrows.items()}
    assert circles(graph) == [["a", "b", "c"], ["d", "e", "f"]]


def test_names_folders_and_long_files_are_counted(tmp_path: Path) -> None:
    house = house_with(tmp_path)
    twice = {name: len(places) for name, places in classes(house).items() if len(places) > 1}
    assert twice == {"Pivot": 2}
    assert folders(house)["ocmm_core/calibration/pivot"] == 3
    assert longer_than(12, house.product.values()) == [
        ("ocmm_core/calibration/pivot/_solve.py", 13)
    ]


def test_comments_are_counted_in_what_numba_compiles(tmp_path: Path) -> None:
    """By a decorator of the product's own; words to tools and texts are no comments."""
    (found,) = kernels(house_with(tmp_path))
    assert found.path == "ocmm_core/calibration/pivot/_kernel.py"
    assert (found.comments, found.code) == (2, 8)
    assert found.per_100 == 25.0


def test_a_face_that_names_it_makes_nothing_used(tmp_path: Path) -> None:
    found = unused(house_with(tmp_path))
    assert [(one.owner, one.name) for one in found.by_anything] == [
        ("Pivot", "lonely"), ("", "never"), ("", "_only_never"),
    ]  # fmt: skip
    assert [one.name for one in found.by_tests_only] == ["hook"]


def test_uses_by_attribute_by_text_and_of_documents_count(tmp_path: Path) -> None:
    (tmp_path / "docs" / "integrator").mkdir(parents=True)
    (tmp_path / "docs" / "integrator" / "python.md").write_text(
        "```python\nfrom ocmm_core.calibration.pivot import never\n```\n"
    )
    house = house_with(
        tmp_path,
        ocmm_core__table="NAMES = ('lonely',)\nvalues = [getattr(None, name) for name in NAMES]",
        ocmm_core__calibration__pivot___more="from ocmm_core.calibration.pivot import _solve\n"
        "_solve.hook()",
    )
    found = unused(house)
    assert (found.by_anything, found.by_tests_only) == ((), ())


def test_the_table_names_what_misses_its_goal(tmp_path: Path) -> None:
    rows = {row.measure: row for row in table(house_with(tmp_path))}
    assert rows["Packages with a face"].today == "3 of 4"
    assert rows["Packages with a face"].listed == ("ocmm_core.calibration has no __all__",)
    assert not rows["Packages with a face"].met
    assert rows["Circles of rooms"].listed == ("ocmm_core.probe · ocmm_core.tip",)
    assert rows["Definitions used by nothing"].today == "3 (3 lines)"
    assert rows["Modules entered past a face, by the product"].met
