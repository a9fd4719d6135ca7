"""U from a calibrated part is used for similar parts, and refused for others."""

from __future__ import annotations

from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from ocmm_core.acceptance import PartTask
from ocmm_core.errors import CalibrationError, InputError
from ocmm_shop.studies import (
    CalibratedPart,
    PartStudy,
    load_part_study,
    load_task,
    make_part_study,
    part_procedure,
    save_part_study,
    uncertainty_for,
)

NOW = datetime(2026, 11, 26, 2, tzinfo=UTC)
RESULTS = [
    25.004, 25.0058, 25.0024, 24.9987, 25.0013, 24.9981, 25.0044, 25.012, 25.001, 25.0003,
    25.0069, 25.0061, 25.0046, 24.9984, 25.0038, 25.0082, 24.9959, 25.0013, 24.9926, 24.9963,
]  # fmt: skip
TASK = PartTask(
    dimension=25.0, points=9, strategy="circle", stylus="ruby 6", material="aluminium",
    clamping="vice",
)  # fmt: skip
DOCUMENT = """
schema = "ocmm.part-task/1"
unit = "mm"
[task]
dimension = 30.0
points = 9
strategy = "Circle"
stylus = "ruby 6"
material = "aluminium"
clamping = "vice"
"""


def study(**changes: object) -> PartStudy:
    given: dict[str, object] = {
        "characteristic": "BORE", "certificate": "P-1", "certified": 25.0, "expanded_cal": 0.0016,
        "u_workpiece": 0.0005, "temperature_c": 22.5, "u_expansion": 1e-6, "made_by": "Ada",
        "now": NOW, "simulated": False, "expanded_model": 0.010, "results": RESULTS, "task": TASK,
    }  # fmt: skip
    given.update(changes)
    part = {one.name: given.pop(one.name) for one in fields(CalibratedPart) if one.name in given}
    return make_part_study(
        given.pop("results"), given.pop("task"), CalibratedPart(**part), **given  # type: ignore[arg-type]
    )  # fmt: skip


def test_the_numbers_are_those_of_the_facts_and_survive_the_file(tmp_path: Path) -> None:
    made = study()
    assert round(made.expanded, 6) == 0.009541
    assert round(made.expanded_uncorrected, 6) == 0.011646
    path = save_part_study(tmp_path, made)
    assert load_part_study(path).record == made
    path.write_bytes(path.read_bytes().replace(b"25.012", b"25.002"))
    with pytest.raises(CalibrationError):
        load_part_study(path)


def test_a_similar_task_gets_the_uncertainty(tmp_path: Path) -> None:
    path = tmp_path / "task.toml"
    path.write_text(DOCUMENT, encoding="utf-8")
    found = uncertainty_for(study(), load_task(path), 22.0)
    # A longer part grows by more: u_b is 0.5 K less, and of 30 mm instead of 25.
    assert found.u_expansion == pytest.approx(2.0 * 1e-6 * 30.0)
    assert found.expanded == pytest.approx(study().expanded, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "celsius", "words"),
    [
        ({"dimension": 50.1}, 22.5, "dimension"),
        ({"angle_deg": 5.1}, 22.5, "angle"),
        ({"points": 8}, 22.5, "8 points"),
        ({"strategy": "scan"}, 22.5, "strategy"),
        ({"stylus": "ruby 3"}, 22.5, "stylus"),
        ({"material": "steel"}, 22.5, "material"),
        ({"clamping": "magnet"}, 22.5, "clamping"),
        ({}, 23.6, "23.6 °C"),
        ({}, 21.4, "21.4 °C"),
        ({}, float("nan"), "nan °C"),
    ],
)
def test_another_task_is_refused(changes: dict[str, object], celsius: float, words: str) -> None:
    wanted = msgspec.structs.replace(TASK, **changes)
    with pytest.raises(InputError) as caught:
        uncertainty_for(study(), wanted, celsius)
    assert words in caught.value.what


def test_a_study_that_contradicts_its_certificate_gives_no_uncertainty() -> None:
    far = [one + 0.05 for one in RESULTS]
    with pytest.raises(InputError, match="E_n of the study"):
        uncertainty_for(study(results=far), TASK, 22.5)


def test_a_study_that_states_another_uncertainty_than_its_results_is_refused() -> None:
    small = msgspec.structs.replace(study(), expanded=0.001)
    with pytest.raises(InputError, match="another U"):
        uncertainty_for(small, TASK, 22.5)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"results": RESULTS[:19]}, "19 results"),
        ({"temperature_c": 35.0}, "rated"),
        ({"temperatures": (23.0, 24.0)}, "rated"),
        ({"expanded_cal": 0.0}, "above zero"),
        ({"u_workpiece": -1.0}, "above zero"),
        ({"procedure": "SPAT"}, "no procedure for calibrated parts"),
    ],
)
def test_what_is_no_study_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        study(**changes)


@pytest.mark.parametrize("field", ["strategy", "stylus", "material", "clamping"])
def test_an_empty_field_is_alike_everywhere_and_refused(tmp_path: Path, field: str) -> None:
    path = tmp_path / "task.toml"
    lines = [f'{field} = " "' if line.startswith(field) else line for line in DOCUMENT.splitlines()]
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=f"task.{field}"):
        load_task(path)


def test_the_gate_is_that_of_the_procedure() -> None:
    rule, numbers, _ = part_procedure()
    assert (numbers.large, numbers.large_share, numbers.small, numbers.angle_deg) == (
        250.0, 0.10, 25.0, 5.0,
    )  # fmt: skip
    assert rule.wording.startswith("modelled on ISO 15530-3")
    narrow = msgspec.structs.replace(rule, test=msgspec.structs.replace(numbers, small=1.0))
    kept = msgspec.structs.replace(study(), procedure=narrow)
    with pytest.raises(InputError, match="may differ by 1 mm"):
        uncertainty_for(kept, msgspec.structs.replace(TASK, dimension=27.0), 22.5)
