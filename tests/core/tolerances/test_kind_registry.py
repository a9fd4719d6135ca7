"""One entry defines a kind: none lacks a field, and no other file lists kinds."""

from __future__ import annotations

import ast
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import Any

import pytest

import ocmm_core
import ocmm_gui
from ocmm_core.errors import InputError, InternalError
from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.kinds import (
    KINDS,
    KindSpec,
    MonteCarlo,
    Symbol,
    characteristic_fault,
    evaluate,
    geometry_value,
    spec_for,
    spec_of,
    symbol_of,
)
from ocmm_core.tolerances.kinds._registry import registered
from ocmm_core.tolerances.zones import Characteristic
from tests.core.tolerances import test_characteristics, test_evaluate

EVERY = pytest.mark.parametrize("spec", KINDS.values(), ids=KINDS)

UNKNOWN = Characteristic(name="X", kind="waviness", features=["top"], upper=0.1)

NEEDED = {item.name for item in fields(KindSpec) if item.default is MISSING} - {
    item.name for item in fields(KindSpec) if item.default_factory is not MISSING
}


@EVERY
@pytest.mark.parametrize("left_out", sorted(NEEDED))
def test_an_entry_without_a_field_cannot_be_made(spec: KindSpec, left_out: str) -> None:
    told: dict[str, Any] = {item.name: getattr(spec, item.name) for item in fields(KindSpec)}
    assert KindSpec(**told) == spec
    del told[left_out]
    with pytest.raises(TypeError, match=left_out):
        KindSpec(**told)


@EVERY
def test_an_entry_says_what_belongs_together(spec: KindSpec) -> None:
    assert spec.name == spec.name.lower().strip() != ""
    assert spec.label.strip()
    assert spec.qif.word.isalpha()
    assert spec.qif.word[0].isupper()
    assert spec.shapes
    assert len(set(spec.shapes)) == len(spec.shapes)
    assert 1 <= spec.features[0] <= spec.features[1]
    assert 0 <= spec.datums[0] <= spec.datums[1]
    # An entry without datums states no shapes for them.
    assert spec.datums[1] or spec.datum_shapes == tuple(Shape)
    # The width of a zone takes points; all else follows from geometry, and is simulated so.
    assert spec.one_sided == (spec.geometry is None)
    assert (spec.monte_carlo is MonteCarlo.SECOND_ORDER) == (spec.geometry is not None)
    assert (spec.monte_carlo is MonteCarlo.RANGE) == spec.form_alone
    assert spec.own_form or not spec.form_alone
    assert spec.probed == "all" or spec.form_alone or not spec.own_form
    assert not spec.qif.has_modifier or spec.zone_of is not None
    assert not spec.zones or (spec.zone_of is not None and "axis" in spec.takes)
    assert spec.folds or not spec.below_u
    assert spec.datums[1] or not spec.datums_make_frame
    assert spec.symbol is not None or not spec.one_sided


@EVERY
def test_a_symbol_has_strokes_within_its_box(spec: KindSpec) -> None:
    for symbol in (*spec.symbol_of_shape.values(), *([spec.symbol] if spec.symbol else [])):
        assert symbol.lines or symbol.circles or symbol.bow
        ends = [point for line in symbol.lines for point in line]
        ends += [(x + s * r, y + s * r) for x, y, r in symbol.circles for s in (-1.0, 1.0)]
        assert all(0.0 <= x <= 1.0 and 0.0 <= y <= 1.0 for x, y in ends)
        # An outline of four corners or more is closed.
        assert all(line[0] == line[-1] for line in symbol.lines if len(line) > 3)


def test_every_kind_has_a_row_with_a_known_answer() -> None:
    rows = (*test_characteristics.KNOWN, *test_evaluate.KNOWN)
    assert {item.kind for item, _ in rows} == set(KINDS)


def test_every_kind_is_explained_in_the_documentation() -> None:
    page = Path(ocmm_core.__path__[0]).parent / "docs" / "quality" / "characteristics.md"
    told = page.read_text(encoding="utf-8")
    assert [name for name in KINDS if f"`{name}`" not in told] == []


def test_an_unknown_kind_is_refused_wherever_it_is_asked_for() -> None:
    for ask in (
        lambda: spec_of("waviness"),
        lambda: spec_for("waviness", Shape.PLANE),
        lambda: symbol_of("waviness", None),
        lambda: evaluate(UNKNOWN, {}, None),
        lambda: geometry_value(UNKNOWN, {}, {}, None),
    ):
        with pytest.raises(InputError, match="Unknown kind of characteristic 'waviness'") as caught:
            ask()
        assert caught.value.code == "characteristic.kind"
        assert "circular runout" in caught.value.remedy
    fault = characteristic_fault(UNKNOWN, {"top": Shape.PLANE}, {}, ["top"], aligned=False)
    assert fault is not None
    assert fault[0] == "kind"
    assert fault[1].startswith("is 'waviness'; known kinds: diameter, radius")


def test_two_entries_of_one_name_and_one_that_stands_for_nothing_are_refused() -> None:
    flatness = KINDS["flatness"]
    with pytest.raises(InternalError, match="Two kinds are named 'flatness'"):
        registered([flatness, flatness])
    for other in ("waviness", "form"):
        lost = replace(flatness, name="lost", stands_for={Shape.PLANE: other})
        with pytest.raises(InternalError, match=f"'lost' stands for '{other}'"):
            registered([*KINDS.values(), lost])


def test_form_is_called_after_its_shape() -> None:
    assert spec_for("form", Shape.LINE) is KINDS["straightness"]
    assert spec_for("form", Shape.SPHERE) is KINDS["form"]
    assert spec_for("form", None) is KINDS["form"]
    assert symbol_of("form", Shape.CYLINDER) == KINDS["cylindricity"].symbol
    assert symbol_of("form", Shape.ELLIPSE) == Symbol(bow="open") == KINDS["line profile"].symbol
    assert symbol_of("form", Shape.TORUS) == KINDS["surface profile"].symbol
    assert symbol_of("coordinate", Shape.CIRCLE) is None


def test_no_file_outside_asks_for_the_name_of_a_kind() -> None:
    """A comparison with a name would silently miss the next kind."""
    own = Path("ocmm_core", "tolerances", "kinds")
    root = Path(ocmm_core.__path__[0]).parent
    found = [
        f"{path.relative_to(root)}:{node.lineno}"
        for package in (ocmm_core, ocmm_gui)
        for path in sorted(Path(package.__path__[0]).rglob("*.py"))
        if not path.relative_to(root).is_relative_to(own)
        # Few files have that word, and parsing every file takes seconds.
        if "kind" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Match | ast.Compare | ast.Subscript) and _asks_for_a_name(node)
    ]
    assert found == []


def _asks_for_a_name(node: ast.AST) -> bool:
    if isinstance(node, ast.Match):
        asked: list[ast.AST] = [node.subject]
        named: list[ast.AST] = list(node.cases)
    elif isinstance(node, ast.Compare):
        asked = named = [node.left, *node.comparators]
    elif isinstance(node, ast.Subscript):
        # A table of one's own by kind.
        asked, named = [node.slice], [node.value]
    else:
        return False
    of_kind = any(isinstance(one, ast.Attribute) and one.attr == "kind" for one in asked)
    names = {
        inner.value
        for one in named
        for inner in ast.walk(one)
        if isinstance(inner, ast.Constant) and isinstance(inner.value, str)
    }
    return of_kind and not names.isdisjoint(KINDS)


@pytest.mark.parametrize(
    "ladder",
    [
        'item.kind == "distance"',
        'item.kind in ("length", "width")',
        'match item.kind:\n    case "angle":\n        pass',
        '{"form": 1}[item.kind]',
    ],
)
def test_a_ladder_is_seen(ladder: str) -> None:
    assert any(_asks_for_a_name(node) for node in ast.walk(ast.parse(ladder)))
