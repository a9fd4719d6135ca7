"""An incomplete job is reported only on explicit request."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.export import EXPORTERS, write_report
from ocmm_core.inspection.evaluation import FeatureState
from ocmm_core.tolerances.decisions import Verdict
from tests.core.export.sample_report import result, sample_report, sample_view


@pytest.mark.parametrize("name", EXPORTERS)
def test_an_incomplete_job_is_refused_by_name_of_what_is_missing(name: str, tmp_path: Path) -> None:
    data = sample_report()
    with pytest.raises(MeasuringError, match=r"BALL|Ball") as refused:
        write_report(data, (name,), tmp_path / "out")
    assert refused.value.code == "export.incomplete"
    assert "report of an incomplete job" in refused.value.remedy
    assert not (tmp_path / "out").exists()
    assert write_report(data, (name,), tmp_path / "out", incomplete=True)


def test_one_incomplete_job_keeps_all_of_a_batch_back(tmp_path: Path) -> None:
    view = sample_view()
    items = tuple(
        replace(result(item.name, 1.0, Verdict.CONFORM), features=item.features)
        for item in view.characteristics
    )
    features = tuple(replace(item, state=FeatureState.DONE) for item in view.features)
    whole = replace(view, job="Block_1", features=features, characteristics=items)
    assert write_report(sample_report(whole), ("json",), tmp_path)
    with pytest.raises(MeasuringError, match="INCOMPLETE"):
        write_report([sample_report(whole), sample_report()], ("json",), tmp_path / "batch")
    assert not (tmp_path / "batch").exists()
    left_out = replace(whole.features[0], state=FeatureState.SKIPPED)
    skipped = replace(whole, features=(left_out, *whole.features[1:]))
    with pytest.raises(MeasuringError, match=left_out.name):
        write_report(sample_report(skipped), ("json",), tmp_path / "skipped")
    open_yet = replace(items[0], verdict=Verdict.PROVISIONAL)
    going = replace(whole, characteristics=(open_yet, *items[1:]))
    with pytest.raises(MeasuringError, match=items[0].name):
        write_report(sample_report(going), ("json",), tmp_path / "going")


def test_files_made_elsewhere_are_written_with_the_others_or_not_at_all(tmp_path: Path) -> None:
    data = sample_report()
    pages = {"Block_report.pdf": b"%PDF"}
    alone = write_report(data, (), tmp_path / "alone", incomplete=True, beside=pages)
    assert [path.name for path in alone] == ["Block_report.pdf"]
    with pytest.raises(MeasuringError):
        write_report(data, ("json",), tmp_path / "both", beside=pages)
    assert not (tmp_path / "both").exists()
    both = write_report(data, ("json",), tmp_path / "both", incomplete=True, beside=pages)
    assert len(both) == 2
    assert all(path.is_file() for path in both)
