"""Typed temperatures: their uncertainty is stated, and one thermometer has one error."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from benchmarks.lie_scenes import honest
from benchmarks.thermometers import run
from ocmm_core.acceptance import ARTEFACT_SCHEMA, ArtefactEntry, ArtefactRegister, read_temperature
from ocmm_core.calibration.guided import require_fresh_temperature
from ocmm_core.calibration.guided._session_events import Reread, SessionHeader, reread
from ocmm_core.calibration.probe_design import Temperature, certified_at, stated_temperature
from ocmm_core.calibration.relocation import relocate
from ocmm_core.errors import CalibrationError, InputError

NOW = datetime(2026, 11, 28, 12, 0, tzinfo=UTC)
POSES = 72


def thermometer(**changes: object) -> ArtefactEntry:
    given: dict[str, object] = {
        "schema": ARTEFACT_SCHEMA, "unit": "mm", "id": "T-1", "kind": "thermometer",
        "name": "room thermometer", "serial": "4711", "laboratory": "lab", "certificate": "C-9",
        "due_utc": "2030-01-01T00:00:00+00:00", "sizes": (), "expanded": 0.2, "expansion": 0.0,
        "expansion_sigma": 0.0, "temperatures": (15.0, 25.0),
    }  # fmt: skip
    return ArtefactEntry(**{**given, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("u", [None, 0.0, -0.2, float("nan"), float("inf"), 21.0])
def test_temperature_needs_stated_uncertainty(u: float | None) -> None:
    with pytest.raises(InputError) as refused:
        stated_temperature(21.3, u)
    assert refused.value.code in ("temperature.u_missing", "temperature.sigma")
    assert stated_temperature(None, None) is None
    assert stated_temperature(21.3, 0.2) == Temperature(21.3, 0.1, "")


def test_certified_length_carries_thermometer() -> None:
    # 400 mm of steel, U 0.2 K: 2 x 400 x 11.5e-6 x 0.1 = 0.92 um.
    length, u = certified_at(400.0, 0.0, 11.5e-6, 0.0, Temperature(22.0, 0.1, ""))
    assert length == pytest.approx(400.0 * (1.0 + 23e-6))
    assert u == pytest.approx(0.00092, rel=1e-6)


def test_thermometer_is_read_from_register(tmp_path: Path) -> None:
    register = ArtefactRegister(tmp_path)
    register.add(thermometer(), "Ann", NOW)
    register.add(thermometer(id="S", kind="sphere", sizes=(25.0,), expanded=0.001), "Ann", NOW)
    read = read_temperature(20.4, "T-1", NOW, tmp_path)
    assert read == Temperature(20.4, 0.1, "room thermometer, serial 4711")
    assert read_temperature(20.4, "0,3", NOW, tmp_path) == Temperature(20.4, 0.15, "")
    for celsius, name, now, why in (
        (26.0, "T-1", NOW, "covers 15 to 25"),
        (20.4, "T-1", NOW + timedelta(days=2000), "expired on 2030-01-01"),
        (20.4, "S", NOW, "is a sphere"),
        (20.4, "T-2", NOW, "no artefact 'T-2'"),
        (20.4, "", NOW, "without the uncertainty"),
    ):
        with pytest.raises(InputError, match=why):
            read_temperature(celsius, name, now, tmp_path)


def test_old_reading_is_asked_again() -> None:
    require_fresh_temperature(None, NOW)
    require_fresh_temperature(NOW - timedelta(minutes=29), NOW)
    with pytest.raises(CalibrationError, match="read 31 min ago"):
        require_fresh_temperature(NOW - timedelta(minutes=31), NOW)


def test_range_of_readings_widens_temperature() -> None:
    begun = SessionHeader(
        utc=NOW.isoformat(), rig="", rig_identity="", running="", who="", software="",
        temperature_c=20.0, temperature_u=0.2,
    )  # fmt: skip
    again = reread(begun, [Reread(utc="", celsius=21.0, expanded_k=0.3)])
    assert again.temperature_c == 20.5
    # The larger U, and a half range of 0.5 K evenly: 2 x 0.5 / sqrt(3).
    assert again.temperature_u == pytest.approx(np.hypot(0.3, 1.0 / np.sqrt(3.0)))
    assert replace_u(begun).temperature == Temperature(20.0, 2.0, "")


def replace_u(begun: SessionHeader) -> SessionHeader:
    """Return a first line of an earlier version, without U."""
    return SessionHeader(
        utc=begun.utc, rig="", rig_identity="", running="", who="", software="",
        temperature_c=begun.temperature_c,
    )  # fmt: skip


def test_relocations_with_wrong_thermometers_hold_their_lengths() -> None:
    """Six sessions of 72 poses: all accepted, and RMS error within 2.5 sigma."""
    for seed in (1, 2, 3, 4, 6, 12):
        found = run((seed, POSES, None))
        assert not found.answer, found
        assert found.error_um < 2.5 * found.sigma_um, found


def test_lying_thermometer_is_named() -> None:
    # Steel bar, aluminium probe, both 5 K warmer than a thermometer with U 0.2 K shows.
    scene = honest(2, POSES)
    scene.length *= 1.0 + 11.5e-6 * 5.0
    tip = scene.body.tip_probe
    scene.leds = tip + (1.0 + 23e-6 * 5.0) * (scene.leds - tip)
    scene.body = replace(scene.body, expansion=(23e-6, 1e-6))
    scene.bar = replace(scene.bar, per_k=11.5e-6 * scene.bar.length)
    options = replace(scene.options, thermometer_k=0.1)
    with pytest.raises(CalibrationError) as refused:
        relocate(scene.start, scene.body, scene.observed(), options, force=True)
    assert "warmer than the stated temperature" in refused.value.what
