"""How warm the cameras were goes through the session into the record."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.calibration.cameras import KnownPointsProcedure
from tests.core.calibration.procedure_site import Bench


def test_the_last_warmth_before_the_result_stands_in_the_record(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    procedure = bench.known_points(60)
    procedure.record_temperature(bench.now(), (36.0, None))
    procedure.record_temperature(bench.now(), (36.0, 37.0))
    procedure.take_table(bench.spots(bench.points(60)), bench.now())
    lines = procedure.base.session.read_bytes().count(b"\n")
    # Thermometers flicker: no news.
    procedure.record_temperature(bench.now(), (36.4, 36.6))
    assert procedure.base.session.read_bytes().count(b"\n") == lines
    procedure.record_temperature(bench.now(), (36.4, 37.5))
    assert procedure.base.session.read_bytes().count(b"\n") == lines + 1
    # Frames after the result do not remove it.
    procedure.compute()
    procedure.record_temperature(bench.now(), (20.0, 20.0))
    again = KnownPointsProcedure.resume(bench.site(), procedure.base.session)
    again.compute()
    for outcome in (procedure.view.outcome, again.view.outcome):
        assert outcome is not None
        assert outcome.record.sensor_temperatures_c == (36.4, 37.5)


def test_where_the_cameras_do_not_tell_nothing_is_kept(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    bench.calibrated(60)
    record = bench.store().active()
    assert record is not None
    assert record.sensor_temperatures_c == ()
