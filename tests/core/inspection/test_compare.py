"""Jobs of a batch side by side."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.finished import ReopenedJob, compare_files, compare_folder, reopen_job
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.wording import load_translation
from tests.core.inspection.recorded_jobs import compare_jobs
from tests.host import HANG_S

PLAN = resource("plans", "quick.toml")


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> tuple[ReopenedJob, ...]:
    """Return six jobs of the quick plan, each with individual errors."""
    folder = tmp_path_factory.mktemp("batch")
    found = []
    for seed in range(6):
        request = StationRequest(
            plan=PLAN, out=folder, frame_rate_hz=500, seed=seed, serial=f"S{seed}"
        )
        built = build_station(request)
        try:
            built.station.start()
            assert built.station.wait_finished(HANG_S)
        finally:
            built.station.close()
        found.append(reopen_job(built.job_path))
    return tuple(found)


def test_every_characteristic_has_its_trend_in_the_order_of_the_jobs(
    batch: tuple[ReopenedJob, ...],
) -> None:
    trends = compare_jobs(batch[::-1])
    assert [trend.name for trend in trends] == [c.name for c in batch[0].plan.characteristics]
    for trend, result in zip(trends, batch[0].view.characteristics, strict=True):
        assert [part.serial for part in trend.parts] == [f"S{seed}" for seed in range(6)]
        assert trend.parts[0].value == result.measured
    counted = [trend for trend in trends if trend.capability is not None]
    assert counted
    for trend in counted:
        assert trend.capability is not None
        assert trend.capability.count == len(trend.values) == 6
        assert "from 6 parts" in trend.capability.summary
        assert trend.chart is not None
        np.testing.assert_array_equal(trend.chart.values, trend.values)


def test_a_job_in_doubt_is_named_and_not_counted(batch: tuple[ReopenedJob, ...]) -> None:
    spoiled = replace(batch[2], faults=("The observation 3 was changed.",))
    unproven = replace(batch[3], view=replace(batch[3].view, unproven="Not calibrated."))
    trend = compare_jobs([*batch[:2], spoiled, unproven, *batch[4:]])[0]
    assert [part.value is None for part in trend.parts] == [False, False, True, True, False, False]
    assert len(trend.left_out) == 2
    assert "was changed" in trend.left_out[0]
    assert "Not calibrated." in trend.left_out[1]
    # Four values are too few for a scatter, so the capability stays empty.
    assert trend.capability is None
    assert "Measure 1 more part" in trend.why_not


def test_a_value_held_back_is_not_counted(batch: tuple[ReopenedJob, ...]) -> None:
    view = batch[0].view
    doubtful = tuple(
        replace(result, verdict=Verdict.NOT_PROVEN, note="held back") if index == 0 else result
        for index, result in enumerate(view.characteristics)
    )
    own = view.feature("SPHERE").points[0].number
    first = replace(batch[0], view=replace(view, held=(own,), characteristics=doubtful))
    assert compare_jobs([first, *batch[1:]])[0].left_out[0].endswith("held back")
    # Held-back points of another feature are no reason.
    other = view.feature("BED").points[0].number
    first = replace(batch[0], view=replace(view, held=(other,), characteristics=doubtful))
    assert compare_jobs([first, *batch[1:]])[0].left_out == ()


def test_simulated_and_real_jobs_stand_in_no_chart_together(batch: tuple[ReopenedJob, ...]) -> None:
    assert all(job.view.simulated for job in batch)
    assert compare_jobs(batch)[0].left_out == ()
    real = [replace(job, view=replace(job.view, simulated=False)) for job in batch[:3]]
    for trend in compare_jobs([*real, *batch[3:]]):
        assert [part.value is None for part in trend.parts] == [False] * 3 + [True] * 3
        assert all("SIMULATED. No real part" in why for why in trend.left_out)
        assert len(trend.left_out) == 3
    assert all(trend.left_out == () for trend in compare_jobs(real))


def test_a_batch_of_simulated_jobs_says_so(batch: tuple[ReopenedJob, ...]) -> None:
    said = CliRunner().invoke(app, ["compare", *(str(job.path) for job in batch)])
    assert said.exit_code == 0, said.output
    lines = said.output.splitlines()
    assert lines[0] == "SIMULATED: No real part was measured."
    for line, job in zip(lines[1:], batch, strict=False):
        assert line.startswith(f"{job.path.stem}: SIMULATED; {job.view.part_verdict.word.value}")
    assert compare_folder(batch[0].path.parent).simulated


def test_a_german_comparison_has_german_verdict_lines(
    batch: tuple[ReopenedJob, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    place = "ocmm_cli.terminal._console._translation"
    monkeypatch.setattr(place, lambda: load_translation("de"))
    said = CliRunner().invoke(app, ["compare", *(str(job.path) for job in batch)])
    for line, job in zip(said.output.splitlines()[1:], batch, strict=False):
        assert line.startswith(f"{job.path.stem}: SIMULIERT; ")
        assert "PART" not in line.removeprefix(job.path.stem)


def test_a_provisional_value_is_not_counted(batch: tuple[ReopenedJob, ...]) -> None:
    view = batch[0].view
    waiting = tuple(
        replace(result, verdict=Verdict.NOT_MEASURED, note="SPHERE is incomplete.")
        for result in view.characteristics
    )
    first = replace(batch[0], view=replace(view, characteristics=waiting))
    for trend in compare_jobs([first, *batch[1:]]):
        assert trend.parts[0].value is None
        assert "is incomplete" in trend.left_out[0]


def test_a_lower_limit_of_zero_is_a_limit_where_a_value_can_be_below_it(
    batch: tuple[ReopenedJob, ...],
) -> None:
    asked = batch[0].plan.characteristics[0]
    assert not spec_of(asked.kind).one_sided
    zero = msgspec.structs.replace(asked, nominal=0.0, lower=0.0, upper=0.1)
    plan = msgspec.structs.replace(
        batch[0].plan, characteristics=[zero, *batch[0].plan.characteristics[1:]]
    )
    trend = compare_jobs([replace(job, plan=plan) for job in batch])[0]
    assert (trend.low, trend.high) == (0.0, 0.1)


def test_one_job_or_the_same_twice_or_of_another_plan_is_refused(
    batch: tuple[ReopenedJob, ...],
) -> None:
    other = replace(batch[1], head=replace(batch[1].head, plan_text="another"))
    for jobs, code in (
        (batch[:1], "compare.too_few"),
        ((batch[0], batch[0]), "compare.twice"),
        ((batch[0], other), "compare.plan"),
    ):
        with pytest.raises(InputError) as caught:
            compare_jobs(jobs)
        assert caught.value.code == code


def test_a_folder_is_compared_by_the_plan_of_its_latest_job(
    batch: tuple[ReopenedJob, ...], tmp_path: Path
) -> None:
    for job in batch[:3]:
        shutil.copy(job.path, tmp_path / job.path.name)
    (tmp_path / "spoiled.ocmm").write_bytes(b"no job")
    told: list[float] = []
    found = compare_folder(tmp_path, lambda what, share: told.append(share))
    assert found.jobs == tuple(job.path.stem for job in batch[:3])
    assert found.plan == batch[0].plan.name
    assert len(found.left_out) == 1
    assert "spoiled.ocmm" in found.left_out[0]
    assert told == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_the_command_prints_what_a_stranger_can_read(
    batch: tuple[ReopenedJob, ...], tmp_path: Path
) -> None:

    paths = [str(shutil.copy(job.path, tmp_path / job.path.name)) for job in batch]
    said = CliRunner().invoke(app, ["compare", *paths])
    assert said.exit_code == 0, said.output
    assert "6 jobs" in said.output
    assert "Cpk" in said.output
    assert "from 6 parts" in said.output


def test_a_bad_file_is_a_line_and_the_others_are_compared(
    batch: tuple[ReopenedJob, ...], tmp_path: Path
) -> None:
    paths = [str(shutil.copy(job.path, tmp_path / job.path.name)) for job in batch[:3]]
    spoiled = tmp_path / "spoiled.ocmm"
    spoiled.write_bytes(b"no job")
    said = CliRunner().invoke(app, ["compare", str(spoiled), *paths])
    assert said.exit_code == 1, said.output
    assert "3 jobs" in said.output
    told = [line for line in said.output.splitlines() if line.startswith("left out: ")]
    assert len(told) == 1
    assert "spoiled.ocmm" in told[0]
    with pytest.raises(InputError) as caught:
        compare_files([spoiled])
    assert caught.value.code == "compare.unread"
    assert "spoiled.ocmm" in caught.value.what


def test_in_processes_side_by_side_the_same_comes_out(
    batch: tuple[ReopenedJob, ...], tmp_path: Path
) -> None:
    paths = [Path(shutil.copy(job.path, tmp_path / job.path.name)) for job in batch]
    (tmp_path / "spoiled.ocmm").write_bytes(b"no job")
    paths.insert(2, tmp_path / "spoiled.ocmm")
    here, aside = (compare_files(paths, processes=many) for many in (1, 2))
    assert here.jobs == aside.jobs
    assert here.words == aside.words
    assert here.unread == aside.unread
    assert len(here.unread) == 1
    for one, other in zip(here.trends, aside.trends, strict=True):
        assert one.left_out == other.left_out
        # The same numbers, bit for bit: the same program on the same computer.
        np.testing.assert_array_equal(one.values, other.values)
        assert one.parts == other.parts


def test_a_folder_without_jobs_has_too_few(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        compare_folder(tmp_path)
    assert caught.value.code == "compare.too_few"
