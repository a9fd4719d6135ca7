"""Nominal and measured values are in one frame, also if the plan uses another one."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.documents import resource
from ocmm_core.export.report import Instrument, ReportData, read_report, reported_features
from ocmm_core.inspection.evaluation import FeatureState, FeatureView
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.measuring import Climate
from tests.core.export.sample_report import HEAD, PART_FROM_WORLD, sample_report, sample_view
from tests.core.export.sample_report import write_incomplete as write_report


def report_by(plan: Plan) -> ReportData:
    """Return the report of a job by a plan in which nothing was measured yet."""
    features = tuple(
        FeatureView(item.name, item.shape, item.points, FeatureState.PENDING, (), None, "")
        for item in plan.features
    )
    view = replace(sample_view(), features=features, characteristics=())
    return ReportData(
        view,
        HEAD,
        plan,
        PART_FROM_WORLD,
        reported_features(view, plan, PART_FROM_WORLD),
        calibration=Instrument("VALID"),
        probe=Instrument("VALID"),
        reference=Instrument(""),
        climate=Climate(),
    )


def test_nominals_are_told_in_the_frame_that_the_datums_make(tmp_path: Path) -> None:
    # Written in the frame of the model, with bore A at (2, -17, 15); the datums put the origin
    # there.
    data = report_by(load_plan(resource("plans", "demo.toml")))
    paths = {path.name: path for path in write_report(data, ("polyworks",), tmp_path)}
    text = paths["Block_07_INCOMPLETE_features.csv"].read_text("ascii")
    rows = {row["Name"]: row for row in csv.DictReader(io.StringIO(text))}
    for name, wanted in {
        "BORE_A": ("0.0000", "0.0000", "0.0000"),
        "BORE_B": ("60.0000", "0.0000", "0.0000"),
        "BORE_D": ("0.0000", "34.0000", "0.0000"),
        "BED": ("-2.0000", "17.0000", "-15.0000"),
        "SPHERE": ("-142.0000", "17.0000", "35.0000"),
    }.items():
        assert tuple(rows[name][axis] for axis in "XYZ") == wanted
    assert rows["SPHERE"]["I"] == ""
    assert rows["EDGE_1"]["I"] == "1.000000"


def test_where_the_nominals_do_not_tell_the_frame_there_are_none() -> None:
    plan = load_plan(resource("plans", "demo.toml"))
    same = [
        msgspec.structs.replace(item, point=(2.0, -17.0, 15.0)) if item.name == "BORE_B" else item
        for item in plan.features
    ]
    data = report_by(msgspec.structs.replace(plan, features=same))
    assert all(item.nominal_element is None for item in data.features)


def test_without_an_alignment_nominals_are_as_they_are_written() -> None:
    plan = load_plan(resource("plans", "demo.toml"))
    data = report_by(msgspec.structs.replace(plan, alignment=None, characteristics=[]))
    for feature, nominal in zip(data.features, plan.features, strict=True):
        assert feature.nominal_element is not None
        np.testing.assert_array_equal(feature.nominal_element.point, nominal.point)


def test_a_feature_that_is_still_being_probed_says_so_in_every_table(tmp_path: Path) -> None:
    view = sample_view()
    bore = replace(view.features[0], state=FeatureState.ACTIVE, needed=6)
    data = sample_report(replace(view, features=(bore, *view.features[1:])))
    paths = {path.name: path for path in write_report(data, ("polyworks", "json"), tmp_path)}
    text = paths["Block_07_INCOMPLETE_features.csv"].read_text("ascii")
    notes = {
        (row["Name"], row["Component"]): row["Note"] for row in csv.DictReader(io.StringIO(text))
    }
    assert notes.pop(("BORE 1", "Measured")) == "Provisional: 4 of 6 points."
    assert set(notes.values()) == {""}
    told = read_report(paths["Block_07_INCOMPLETE.json"].read_bytes()).features[0]
    assert told.note == "Provisional: 4 of 6 points."
