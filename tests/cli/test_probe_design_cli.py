"""``ocmm probe design``, and temperatures of ``ocmm measure``, as a stranger uses them."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

import pytest

from ocmm_core.acceptance import ArtefactRegister, TemperatureSource
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.composition import ClimateRequest, climate_in_use
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import CLIMATE_EVENT, climate_of_text
from ocmm_core.storage import JobFile
from ocmm_core.tracking import load_probe
from tests.commands import Ocmm
from tests.core.calibration.made_probe_records import make_probe_record
from tests.core.calibration.test_thermometer_u import thermometer

QUICK = resource("plans", "quick.toml")
THESIS = ("--probe", resource("probes", "thesis.toml"), "--rig", resource("rigs", "thesis.toml"))
PROBE = resource("probes", "standard.toml")
DESIGN = resource("designs", "standard.toml")


def test_the_probe_of_the_thesis_is_examined(ocmm_here: Ocmm, tmp_path: Path) -> None:
    done = ocmm_here("probe", "design", *THESIS, "--all-seen", "--out", "figures")
    assert (done.returncode, done.stderr) == (0, "")
    number = re.search(r"Uncertainty of the tip from spot noise: ([\d.]+) µm", done.stdout)
    assert number is not None
    # 21.9 um in a volume 200 mm deep; this rig accepts 150 mm.
    assert float(number.group(1)) == pytest.approx(21.9, rel=0.02)
    for words in (
        "Growth: 1.75 µm/K",
        "0.192 N and the hand 1.704 N",
        "the tip is 42.0 nm off",
        "321 nm/N across the panel",
        "The LEDs cannot be confused.",
        "Force of the hand",
    ):
        assert words in done.stdout
    figures = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert figures == [
        "probe_bending.svg", "probe_tilt.svg", "probe_volume_front.svg", "probe_volume_top.svg",
    ]  # fmt: skip
    for name in figures:
        ElementTree.parse(tmp_path / "figures" / name)  # noqa: S314 - our own file
        assert name in done.stdout


def test_a_probe_without_a_design_says_so(ocmm_here: Ocmm, tmp_path: Path) -> None:
    text = resource("probes", "standard.toml").read_text("utf-8")
    (tmp_path / "mine.toml").write_text(text.replace('"standard"', '"mine"'), "utf-8")
    done = ocmm_here("probe", "design", "--probe", "mine.toml", "--poses", "200")
    assert done.returncode == 0
    assert "Growth and bending: not known." in done.stdout
    assert "Temperature of the probe" not in done.stdout


def test_both_compensations_are_in_the_job_and_in_the_report(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    done = ocmm_here(
        "measure", "--rig", slow_rig, "--plan", QUICK, "--out", "out", "--probe-design", DESIGN,
        "--probe-temperature", "24", "--compensate-probe", "--part-temperature", "23",
        "--temperature-sigma", "0.5", "--part-expansion", "11.5", "--compensate-part",
    )  # fmt: skip
    assert done.stderr == ""
    assert "calibrated at 20.0 °C, compensated." in done.stdout
    report = tmp_path / "out/QUICK-001_SIMULATED_report.csv"
    with report.open(newline="", encoding="ascii") as stream:
        (said,) = {row["Temperature"] for row in csv.DictReader(stream)}
    assert "Probe: 24.0 +- 0.5 C; calibrated at 20.0 C; compensated." in said
    assert "results reported at 20 C with 11.5 +- 1.0 ppm/K" in said
    with JobFile.open(tmp_path / "out/QUICK-001.ocmm", read_only=True) as job:
        (text,) = [event.text for event in job.events() if event.kind == CLIMATE_EVENT]
        assert job.verify() == []
    climate = climate_of_text(text)
    assert climate.probe.compensated
    assert climate.part.compensated
    assert climate.probe_design == DESIGN.read_text("utf-8")


def test_what_is_not_known_is_not_compensated(ocmm_here: Ocmm, tmp_path: Path) -> None:
    done = ocmm_here("measure", "--plan", QUICK, "--out", "out", "--compensate-part")
    assert done.returncode == 2
    assert "needs the part temperature" in done.stderr
    assert "Measure and give it" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (ClimateRequest(compensate_part=True), "temperature.part_unknown"),
        (ClimateRequest(None, None, 22.0, 0.5, None, False, True), "temperature.expansion_unknown"),
        (ClimateRequest(None, 22.0, None, 0.5, None, True), "temperature.design_unknown"),
        (ClimateRequest(DESIGN, compensate_probe=True), "temperature.probe_unknown"),
        (ClimateRequest(part_c=220.0), "temperature.range"),
        (ClimateRequest(part_c=22.0), "temperature.u_missing"),
        (ClimateRequest(probe_c=22.0), "temperature.u_missing"),
        (ClimateRequest(DESIGN, probe_c=-30.0), "temperature.range"),
        (ClimateRequest(probe_c=-30.0), "temperature.range"),
        (ClimateRequest(sigma_k=0.5, part_c=22.0, part_expansion_ppm=1e4), "temperature.expansion"),
        (ClimateRequest(sigma_k=0.5, part_c=22.0, stated_u="0.2"), "temperature.u_twice"),
        (ClimateRequest(part_c=22.0, stated_u="50"), "temperature.sigma"),
        (ClimateRequest(part_c=22.0, stated_u="T-77"), "artefact.unknown"),
    ],
)
def test_every_doubt_has_its_own_refusal(request_: ClimateRequest, code: str) -> None:
    with pytest.raises(InputError) as caught:
        climate_in_use(request_, load_plan(QUICK), load_probe(PROBE), None)
    assert caught.value.code == code
    assert caught.value.remedy


def test_the_temperature_of_the_calibration_comes_from_its_record() -> None:
    body, plan = load_probe(PROBE), load_plan(QUICK)
    request = ClimateRequest(DESIGN, sigma_k=0.5, probe_c=25.0, compensate_probe=True)
    record = make_probe_record(temperature_c=22.0)
    used = climate_in_use(request, plan, body, record)
    assert used.climate.probe.difference_k == pytest.approx(3.0)
    by_design = climate_in_use(request, plan, body, None)
    assert by_design.climate.probe.difference_k == pytest.approx(5.0)
    # A record that does not say how warm it was is not helped out by the design.
    silent = make_probe_record(temperature_c=None)
    with pytest.raises(InputError, match="temperature at calibration, which is unknown"):
        climate_in_use(request, plan, body, silent)


def test_a_job_names_its_thermometer_or_the_u_of_its_certificate() -> None:
    register = ArtefactRegister()
    register.add(thermometer(id="T-5"), "Ann", datetime(2026, 11, 28, tzinfo=UTC))
    for stated, sigma, origin in (
        ("0,3", 0.15, "given by the operator"), ("T-5", 0.1, "room thermometer, serial 4711"),
    ):  # fmt: skip
        request = ClimateRequest(part_c=22.0, probe_c=21.0, stated_u=stated)
        used = climate_in_use(request, load_plan(QUICK), load_probe(PROBE), None).climate
        assert used.part.now == Temperature(22.0, sigma, origin)
        assert used.probe.now == Temperature(21.0, sigma, origin)


def test_a_part_temperature_that_is_not_typed_is_read_by_its_source(tmp_path: Path) -> None:
    sensor = tmp_path / "temp1_input"
    sensor.write_text("21750\n", "ascii")
    reads = TemperatureSource(kind="file", address=str(sensor), unit="°C", scale=0.001)
    register = ArtefactRegister()
    register.add(thermometer(id="T-6", reads=reads), "Ann", datetime(2026, 11, 28, tzinfo=UTC))
    asked = ClimateRequest(
        stated_u="T-6", part_expansion_ppm=11.5, compensate_part=True, probe_c=20.0
    )
    plan, body = load_plan(QUICK), load_probe(PROBE)

    part = climate_in_use(asked, plan, body, None).climate.part

    assert part.now == Temperature(21.75, 0.1, "room thermometer, serial 4711")
    assert part.scale == pytest.approx(1.0 - 1.75 * 11.5e-6, abs=1e-12)
    # Without compensation nothing needs it, and no sensor is asked.
    sensor.unlink()
    silent = replace(asked, compensate_part=False)
    assert climate_in_use(silent, plan, body, None).climate.part.now is None
    with pytest.raises(InputError, match="cannot be read"):
        climate_in_use(asked, plan, body, None)


def test_the_material_of_the_plan_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    text = QUICK.read_text("utf-8")
    path.write_text(f'{text}\n[material]\nname = "brass"\nexpansion_ppm = 18.5\n', "utf-8")
    request = ClimateRequest(sigma_k=0.5, part_c=22.0, compensate_part=True)
    used = climate_in_use(request, load_plan(path), load_probe(PROBE), None)
    assert used.climate.part.scale == pytest.approx(1.0 - 37e-6, abs=1e-12)
    path.write_text(f'{text}\n[material]\nname = "brass"\nexpansion_ppm = 1850\n', "utf-8")
    with pytest.raises(InputError, match=r"material\.expansion_ppm"):
        load_plan(path)
