"""Each number that a person types into a form is finite and within its range, or refused."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest

from ocmm_core.acceptance import typed_entry
from ocmm_core.errors import InputError
from ocmm_core.options import WINDOW
from ocmm_core.settings import SETTINGS, Kind, value_of_text
from ocmm_core.typed_numbers import (
    COORDINATE,
    EXPANDED,
    EXPANSION,
    EXPANSION_SIGMA,
    FORM,
    PER_LENGTH,
    SIZE,
)
from ocmm_gui.arguments import parser
from ocmm_gui.plan_editor._field_labels import FieldUnit
from ocmm_gui.plan_editor._field_text import value_of
from ocmm_gui.plan_editor._form_lines import FieldKind, FormLine
from tests.core.test_typed_numbers import HOSTILE

TEXTS = (*HOSTILE, "-1", "1e300", "1,5", "1e-400", "text", "1 in", "9" * 400)
ARTEFACT = {
    "id": "S-1", "kind": "sphere", "name": "Ball", "maker": "M", "serial": "1",
    "laboratory": "L", "certificate": "C1", "due_utc": "2030-01-01", "sizes": "25.0003",
    "expanded": "0.0003", "expansion": "5.4e-6", "expansion_sigma": "5e-7",
}  # fmt: skip
OF_ARTEFACT = {
    "sizes": SIZE, "expanded": EXPANDED, "expanded_per_length": PER_LENGTH, "form": FORM,
    "expansion": EXPANSION, "expansion_sigma": EXPANSION_SIGMA,
}  # fmt: skip


def entry_with(field: str, text: str) -> float:
    found = getattr(typed_entry({**ARTEFACT, field: text}), field)
    return float(found[0] if isinstance(found, tuple) else found)


def fields() -> Iterator[tuple[str, Callable[[str], Any], float, float]]:
    for spec in SETTINGS:
        if spec.kind in (Kind.NUMBER, Kind.WHOLE):
            limits = spec.quantity
            yield spec.key, partial(value_of_text, spec), limits.least, limits.most
    for name, field in OF_ARTEFACT.items():
        one = field.quantity
        yield name, partial(entry_with, name), one.least, one.most
    for kind in (FieldKind.NUMBER, FieldKind.COUNT, FieldKind.NUMBERS):
        for measure in FieldUnit:
            line = FormLine(key="x", label="Size", tip="mm", kind=kind, measure=measure)
            one = COORDINATE.quantity
            name = f"plan {kind.name} {measure.name}"
            yield name, partial(value_of, line), one.least, one.most
    fields_of = {option.typed[0]: option.field for option in WINDOW}
    for action in parser()._actions:  # noqa: SLF001 - there is no public list
        number = fields_of.get((action.option_strings or [""])[0])
        if number is not None and callable(action.type):
            one = number.quantity
            yield action.option_strings[0], action.type, one.least, one.most


FIELDS = list(fields())


@pytest.mark.parametrize(("name", "read", "least", "most"), FIELDS, ids=[one[0] for one in FIELDS])
def test_a_typed_text_is_refused_or_within_the_range(
    name: str, read: Callable[[str], Any], least: float, most: float
) -> None:
    refused = 0
    for text in TEXTS:
        try:
            found = read(text)
        except (InputError, ArgumentTypeError):
            refused += 1
            continue
        for value in found if isinstance(found, list) else [found]:
            if value is not None and text.strip():
                assert math.isfinite(value)
                assert least <= value <= most, text
    assert refused > len(TEXTS) // 4
    assert len(FIELDS) > 30
