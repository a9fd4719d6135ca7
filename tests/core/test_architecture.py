"""The picture of the architecture and the table of the rooms are those of the sources."""

from __future__ import annotations

import re

import pytest

from benchmarks.house_tree import ROOTS
from docs.images.architecture_layers import layered, levels, reduced
from docs.images.architecture_rooms import Rooms, read_rooms, with_table
from docs.images.make_architecture import PAGE, PICTURE, ROOT, picture
from tests.sources import uncollected

REMEDY = "run python -m docs.images.make_architecture"


@pytest.fixture(scope="module")
def rooms() -> Rooms:
    with uncollected():
        return read_rooms(ROOT)


def test_the_stored_picture_is_that_of_the_imports(rooms: Rooms) -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture(rooms), REMEDY


def test_the_table_holds_the_first_line_of_every_face(rooms: Rooms) -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page, rooms), REMEDY
    for room in rooms.summaries.keys() - set(ROOTS):
        assert page.count(f"| `{room}` | ") == 1


def test_arrows_that_follow_from_others_are_left_out_and_long_ones_pass_every_layer() -> None:
    graph = {
        "roof": frozenset({"wall", "floor", "ground"}),
        "wall": frozenset({"floor"}),
        "floor": frozenset({"ground"}),
        "mast": frozenset({"ground"}),
        "ground": frozenset[str](),
        "flag": frozenset({"roof", "mast"}),
    }
    less = reduced(graph)
    assert less["roof"] == {"wall"}
    assert less["flag"] == {"roof", "mast"}
    assert levels(less) == {"ground": 0, "floor": 1, "mast": 1, "wall": 2, "roof": 3, "flag": 4}
    plan = layered(less)
    (long,) = (path for path in plan.paths if path[0] == "flag" and path[-1] == "mast")
    assert len(long) == 4
    of = {name: level for level, layer in enumerate(plan.layers) for name in layer}
    assert [of[name] for name in long] == [4, 3, 2, 1]


@pytest.mark.parametrize("page", ["docs/developer/architecture.md", "CONTRIBUTING.md"])
def test_the_files_that_a_map_names_are_there(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:ocmm_core|ocmm_gui|tests|docs)/[\w/.]+\.\w+)`", text))
    if page.startswith("docs"):
        assert len(named) >= 20
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []
