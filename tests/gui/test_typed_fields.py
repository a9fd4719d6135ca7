"""Each number that a person types into a form is finite and within its range, or refused."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from ocmm_core.acceptance import typed_entry
from ocmm_core.ambient import QUANTITIES, Quantity, reading_of
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.calibration.probe_design import examine
from ocmm_core.documents import load_document, resource
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.options import WINDOW
from ocmm_core.settings import SETTINGS, Kind, value_of_text
from ocmm_core.tracking import SCHEMA, ProbeDocument
from ocmm_core.typed_numbers import (
    BALL,
    COORDINATE,
    EXPANDED,
    EXPANSION,
    EXPANSION_SIGMA,
    FORM,
    PER_LENGTH,
    SIZE,
    SPOT_NOISE,
    TEMPERATURE,
    TILT,
)
from ocmm_gui._start import parser
from ocmm_gui.maintain._probe_design_page import _numbers
from ocmm_gui.plan_editor._field_labels import FieldUnit
from ocmm_gui.plan_editor._form_lines import FieldKind, FormLine, value_of
from ocmm_gui.wizards._sessions import _diameter
from ocmm_gui.wizards._site import temperature
from ocmm_gui.wizards.pages._definition_form import DefinitionForm
from tests.core.test_typed_numbers import HOSTILE
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

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


_KELVIN = Quantity("thermometer", "K", 0.0, 20.0)
"""U (k = 2) of a thermometer."""


def entry_with(field: str, text: str) -> float:
    found = getattr(typed_entry({**ARTEFACT, field: text}), field)
    return float(found[0] if isinstance(found, tuple) else found)


NOW = datetime(2026, 11, 28, tzinfo=UTC)


def warm(key: str, text: str) -> float | None:
    found = temperature({"temperature": "20", "thermometer": "0.2", key: text}, NOW)
    if found is None:
        return None
    return found.celsius if key == "temperature" else 2.0 * found.sigma_k


def reading(one: Quantity, text: str) -> list[float | None]:
    found = reading_of(one, text)
    return [None] if found is None else [found.low, found.high]


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
    for key, one in (("temperature", TEMPERATURE.quantity), ("thermometer", _KELVIN)):
        yield f"wizard {key}", partial(warm, key), one.least, one.most
    yield "wizard ball", _diameter, BALL.quantity.least, BALL.quantity.most
    for one in QUANTITIES:
        yield f"room {one.field}", partial(reading, one), one.least, one.most
    for number in (TILT, SPOT_NOISE):
        one = number.quantity
        read = partial(_numbers, number, one.field)
        yield f"design {one.field}", partial(read, count=1), one.least, one.most
    fields_of = {option.typed[0]: option.field for option in WINDOW}
    for action in parser()._actions:  # noqa: SLF001 - there is no public list
        own = fields_of.get((action.option_strings or [""])[0])
        if own is not None and callable(action.type):
            one = own.quantity
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


def test_a_room_is_not_wider_than_its_range() -> None:
    for one in QUANTITIES:
        with pytest.raises(InputError, match="is not between"):
            reading_of(one, f"{one.most:g} ± 9999")


_SUSPECTS = ("nan", "inf", "-inf", "-6", "6000", "1e400", "1,2,3", "1.234,5", "6 bananas", "six")


@pytest.mark.slow
def test_no_wizard_starts_with_an_impossible_number(open_window: OpenWindow, qtbot: QtBot) -> None:
    """N = 150 texts in 15 fields of 7 wizards; each stays usable and says the range."""
    window = open_window(start=False, practice=True).window
    typed = 0
    for kind in ProcedureKind:
        window.maintenance.open_wizard(kind)
        wizard = window.maintenance.wizard
        fields = [
            (key, wizard.start.fields[key])
            for key in ("temperature", "thermometer", "nominal")
            if key in wizard.start.fields
        ]
        for key, field in fields:
            assert isinstance(field, QLineEdit)
            before = field.text()
            for text in _SUSPECTS:
                for other, text_of in (("temperature", "20"), ("thermometer", "0.2"), (key, text)):
                    line = wizard.start.fields[other]
                    assert isinstance(line, QLineEdit)
                    line.setText(text_of)
                wizard.start.begin_button.click()
                assert wizard.start.trouble.text(), (kind, key, text)
                assert wizard.runner is None, (kind, key, text)
                assert wizard.start.begin_button.isEnabled()
                typed += 1
            field.setText(before)
        wizard.leave()
    assert typed == 150


@pytest.mark.slow
def test_no_acceptance_test_starts_with_an_impossible_number(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    """N = 40 texts in 4 fields."""
    window = open_window(start=False, tests=True).window
    window.tests.calls()["acceptance"]()
    start = window.tests.desk.start
    qtbot.waitUntil(
        lambda: start.begin_button.isEnabled() and not start.unfinished.count(), timeout=HANG_MS
    )
    # A word may be the id of a thermometer, which is searched in the background.
    for key, field in start.fields.items():
        if key not in ("temperature", "thermometer", "humidity", "pressure"):
            continue
        before = field.text()
        for text in _SUSPECTS:
            start.show_trouble("")
            field.setText(text)
            start.begin_button.click()
            qtbot.waitUntil(lambda: bool(start.trouble.text()), timeout=HANG_MS)
            assert window.tests.desk.runner is None, (key, text)
        field.setText(before)
        start.show_trouble("")


def test_a_probe_is_not_defined_by_impossible_numbers(qtbot: QtBot, tmp_path: Path) -> None:
    form = DefinitionForm()
    qtbot.addWidget(form)
    document = load_document(resource("probes", "standard.toml"), ProbeDocument, SCHEMA)
    form.show_document(document)
    for key in ("tip_diameter", "tip_diameter_sigma", "led_sigma", "emission_half_angle_deg"):
        before = form.fields[key].text()
        for text in ("nan", "inf", "-6", "1e9", "1,234", "six", "6 bananas"):
            form.fields[key].setText(text)
            with pytest.raises(OcmmError):
                examine(form.document(document.leds), tmp_path / "p.toml", lambda *_told: None)
        form.fields[key].setText(before)
    examine(form.document(document.leds), tmp_path / "p.toml", lambda *_told: None)
