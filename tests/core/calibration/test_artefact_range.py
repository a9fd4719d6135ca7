"""An artefact is used where its certificate holds; a temperature is judged in one place."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.calibration.guided import SessionHeader
from ocmm_core.calibration.probe_design import Temperature, require_temperature
from ocmm_core.calibration.records import load_bar, load_sphere
from ocmm_core.composition import ClimateRequest, climate_in_use
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import PartTemperature, check_part
from ocmm_core.tracking import load_probe
from ocmm_gui.wizards import temperature

BAR = resource("artefacts", "bar.toml")
SPHERE = resource("artefacts", "sphere.toml")
NOW = datetime(2026, 3, 1, tzinfo=UTC)


def written(folder: Path, document: Path, line: str) -> Path:
    """Return a copy of a document with one line more at its head."""
    path = folder / document.name
    path.write_text(document.read_text("utf-8").replace('unit = "mm"', f'unit = "mm"\n{line}'))
    return path


@pytest.mark.parametrize("celsius", [9.9, 35.1])
def test_outside_the_rated_range_an_artefact_is_refused(celsius: float) -> None:
    artefact = load_bar(BAR).artefact
    (found,) = artefact.judge(400.0, math.inf, NOW, at(celsius))
    assert found.refuses
    assert found.what == (
        "The certificate of 'virtual bar 400' (serial B-400-1) covers 10 to 35 °C, but the "
        f"ambient temperature is given as {celsius:g} °C."
    )
    with pytest.raises(InputError, match="covers 10 to 35"):
        artefact.at(400.0, at(celsius))


@pytest.mark.parametrize("celsius", [None, 10.0, 20.0, 35.0])
def test_inside_it_is_used(celsius: float | None) -> None:
    artefact = load_sphere(SPHERE).artefact
    assert artefact.judge(30.0, math.inf, NOW, at(celsius)) == []
    assert artefact.at(30.0, at(celsius))[0] > 0.0


def test_the_range_of_the_certificate_counts(tmp_path: Path) -> None:
    artefact = load_bar(written(tmp_path, BAR, "temperatures = [18.0, 22.0]")).artefact
    assert artefact.judge(400.0, math.inf, NOW, at(18.0)) == []
    (found,) = artefact.judge(400.0, math.inf, NOW, at(25.0))
    assert "covers 18 to 22 °C" in found.what


@pytest.mark.parametrize("said", ["[22.0, 18.0]", "[-40.0, 22.0]", "[18.0, 200.0]"])
def test_a_range_that_is_none_is_refused(tmp_path: Path, said: str) -> None:
    with pytest.raises(InputError, match="field 'temperatures'"):
        load_bar(written(tmp_path, BAR, f"temperatures = {said}"))


def test_lengths_beyond_the_certificate_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'nests' has a length of 320 mm.*covers 50 to 300 mm"):
        load_bar(written(tmp_path, BAR, "certified = [50.0, 300.0]"))
    with pytest.raises(InputError, match="'nests' has a length of 80 mm"):
        load_bar(written(tmp_path, BAR, "certified = [100.0, 500.0]"))
    with pytest.raises(InputError, match="'diameter' has a length of 30 mm"):
        load_sphere(written(tmp_path, SPHERE, "certified = [10.0, 25.0]"))
    assert load_bar(written(tmp_path, BAR, "certified = [80.0, 400.0]")).nests[-1] == 400.0


def at(celsius: float | None) -> Temperature | None:
    return None if celsius is None else Temperature(celsius, 0.3, "")


def begun(celsius: float | None) -> SessionHeader:
    """Return the first line of a session."""
    return SessionHeader(
        utc="", rig="", rig_identity="", running="", who="", software="", temperature_c=celsius
    )


@pytest.mark.parametrize("celsius", [200.0, -40.0, math.nan, math.inf])
def test_every_entry_says_the_same(celsius: float) -> None:
    said = []
    plan, probe = load_plan(resource("plans", "quick.toml")), resource("probes", "standard.toml")
    request = {"part": ClimateRequest(part_c=celsius), "probe": ClimateRequest(probe_c=celsius)}
    entries: dict[str, Callable[[], object]] = {
        "surroundings": lambda: require_temperature("surroundings", celsius),
        "surroundings ": lambda: begun(celsius),
        "surroundings   ": lambda: load_bar(BAR).artefact.judge(400.0, 1.0, NOW, at(celsius)),
        "part": lambda: climate_in_use(request["part"], plan, load_probe(probe), None),
        "part ": lambda: check_part(PartTemperature(Temperature(celsius, 0.5, ""))),
        "probe": lambda: climate_in_use(request["probe"], plan, load_probe(probe), None),
    }
    for what, enter in entries.items():
        with pytest.raises(InputError) as raised:
            enter()
        assert raised.value.code == "temperature.range"
        assert raised.value.what == (
            f"The temperature of the {what.strip()} is given as {celsius:g} °C."
        )
        said.append(raised.value.remedy)
    assert set(said) == {"Give it in degrees Celsius, from 0 to 50."}
    with pytest.raises(InputError, match="The typed temperature is") as raised:
        temperature({"temperature": str(celsius)}, NOW)
    assert raised.value.remedy == "Enter a number from 0 to 50 °C."
    assert begun(None).temperature_c is None
    assert begun(21.5).temperature_c == 21.5
