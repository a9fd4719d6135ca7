"""The JSON report conforms to the published schema."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec
import pytest

from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import ReportData, ReportFile, polyworks_profile
from tests.core.export.sample_report import sample_report, sample_view
from tests.host import needs_package

SCHEMA_FILE = Path(__file__).resolve().parents[3] / "docs" / "report.schema.json"
DRAFT = "https://json-schema.org/draft/2020-12/schema"


def written(data: ReportData) -> Any:
    (content,) = EXPORTERS["json"].contents((data,), polyworks_profile()).values()
    return json.loads(content)


@pytest.fixture(name="validator")
def _validator() -> Any:
    needs_package("jsonschema", "it comes with what checks the bill of materials")
    jsonschema = import_module("jsonschema")
    schema = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_stored_schema_is_made_from_the_types() -> None:
    stored = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
    assert stored.pop("$schema") == DRAFT
    assert stored == json.loads(msgspec.json.encode(msgspec.json.schema(ReportFile))), (
        "run python docs/make_tables.py"
    )


def test_every_report_keeps_to_it(validator: Any) -> None:
    view = sample_view()
    jobs = (
        sample_report(),
        sample_report(frame=None),
        sample_report(replace(view, simulated=True, unproven="Not calibrated.", held=(2,))),
        sample_report(replace(view, characteristics=())),
    )
    for data in jobs:
        assert [error.message for error in validator.iter_errors(written(data))] == []


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        (("results", 0, "measured"), "20.0"),
        (("features", 0, "points"), None),
        (("observations", 0, "tip_world"), [1.0, 2.0]),
        (("job", "complete"), 1),
        (("head", 0, "value"), 3),
        (("unknown",), "word"),
    ],
)
def test_what_is_no_report_does_not(validator: Any, place: tuple[Any, ...], wrong: Any) -> None:
    report = written(sample_report())
    inside = report
    for key in place[:-1]:
        inside = inside[key]
    inside[place[-1]] = wrong
    assert not validator.is_valid(report)
