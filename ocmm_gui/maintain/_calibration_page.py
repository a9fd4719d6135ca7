"""Calibration page: status, facts and history."""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.calibration import records
from ocmm_core.calibration.records import (
    CalibrationOverview,
    CalibrationView,
    CameraRecord,
    VerificationRecord,
)
from ocmm_core.camera import Rig
from ocmm_gui.charts import HistoryChart, session_of
from ocmm_gui.kit import later, localised, said, stacked, tr
from ocmm_gui.maintain._status_page import EventLine, EventTable, StatusPage, in_a_row, local_time

DESIGN = later("Virtual cameras: the geometry of the rig document is used.")
_IN_ORDER = later("Calibrated, verified and in date. Points can be taken.")
_NO_HISTORY = later("No calibration of this rig is stored on this computer.")
_FACTS = (
    (later("Rig"), later("name in the rig document")),
    (later("Cameras"), later("with their serial numbers")),
    (later("Method"), later("calibration method")),
    (later("Calibrated"), later("when, and by whom")),
    (later("Valid until"), later("no points are taken after this date")),
    (later("Positions"), later("reference positions or poses used; outliers left out")),
    (later("Residuals"), later("RMS of the residuals, and chi-square per degree of freedom")),
    (later("Volume"), later("calibrated volume, mm")),
    (later("Warmth"), later("ambient and sensor temperatures during calibration")),
    (later("Artefacts"), later("traceability: artefacts with serial numbers")),
    (later("Verified"), later("date, and the error closest to its limit")),
    (later("Hash"), later("of the record or rig document; printed in jobs and reports")),
)


_COLUMNS = (
    (later("Time"), later("Local time")),
    (later("What happened"), later("Calibration concerned, see the last column")),
    (later("Who"), later("As entered")),
    (later("Why"), later("As entered, or the rule applied")),
    (later("Good until"), later("If suspect: last time known good")),
    (later("Calibration"), later("First digits of its hash")),
)
_EVENTS = {
    records.EventKind.ACCEPTED: (later("Activated"), "text"),
    records.EventKind.PASSED: (later("Verification passed"), "good"),
    records.EventKind.FAILED: (later("Verification FAILED"), "bad"),
    records.EventKind.SUSPECTED: (later("Marked suspect"), "warn"),
    records.EventKind.FALLEN: (later("Artefact found WRONG"), "bad"),
    records.EventKind.RECALLED: (later("Jobs recalled"), "text"),
}
"""Word and colour of each kind."""
_IN_DOUBT = later("Recall jobs (F12) shows which of their verdicts hold.")


class CalibrationPage(StatusPage[CalibrationView, CalibrationOverview]):
    """Status, facts, trends and history of the calibration."""

    def __init__(
        self,
        rig: Rig,
        pull: Callable[[], CalibrationView],
        pull_overview: Callable[[], CalibrationOverview],
    ) -> None:
        super().__init__(
            tr("Calibration"), tr("Status of the calibration"), _FACTS, pull, pull_overview,
            in_order=tr(_IN_ORDER), design=tr(DESIGN), in_doubt=tr(_IN_DOUBT),
        )  # fmt: skip
        self._rig = rig
        self.focal = HistoryChart(tr("Focal length, Δ µm"), factor=1e3, reach=2.0)
        self.principal = (
            HistoryChart(tr("Principal point, Δu px"), reach=0.2, form="+.2f"),
            HistoryChart(tr("Principal point, Δv px"), reach=0.2, form="+.2f"),
        )
        self.baseline = HistoryChart(tr("Camera distance, Δ µm"), factor=1e3, reach=5.0)
        self.error = HistoryChart(
            tr("Verified error, % of limit"),
            factor=100.0,
            reach=100.0,
            changes=False,
            limit=100.0,
            form="+.0f",
        )
        self.history = EventTable(_COLUMNS, toned=(1,), plain=(3,), long=(3,))
        self._charts = in_a_row(
            stacked(self.focal), stacked(*self.principal), stacked(self.baseline),
            stacked(self.error),
        )  # fmt: skip
        self._lay_out((self._charts, 5), (self.fault, 2), (self.history, 4))

    def _show_overview(self, view: CalibrationView, found: CalibrationOverview) -> None:
        self._show_facts(_facts(self._rig, view, found.verifications.get(view.identity)))
        self.focal.show_courses(found.trends.focal)
        for chart, courses in zip(
            self.principal, (found.trends.principal_u, found.trends.principal_v), strict=True
        ):
            chart.show_courses(courses)
        self.baseline.show_courses(found.trends.baseline)
        self.error.show_courses((found.trends.error,))
        self.history.show_lines([_line(event) for event in found.events])
        self.fault.tell(found.fault or ("" if found.events else tr(_NO_HISTORY)))
        self._charts.setVisible(bool(found.trends.focal))
        self.history.setVisible(bool(found.events))


def _line(event: records.Event) -> EventLine:
    word, tone = _EVENTS[event.kind]
    cells = (
        local_time(event.utc),
        tr(word),
        event.who,
        said(event.reason),
        local_time(event.since_utc) if event.since_utc else "",
        event.calibration[:12],
    )
    return EventLine(cells, tone)


def _facts(
    rig: Rig, view: CalibrationView, verification: VerificationRecord | None
) -> dict[str, str]:
    words = dict.fromkeys((name for name, _ in _FACTS), "–")
    low, high = (" ".join(f"{value:.0f}" for value in corner) for corner in rig.volume_world)
    words |= {
        "Rig": rig.name,
        "Cameras": ", ".join(f"{camera.name} {camera.serial}" for camera in rig.cameras),
        "Volume": tr("{low} to {high} mm").format(low=low, high=high),
        "Hash": view.identity[:12],
        "Method": tr("none, the rig document"),
    }
    if view.record is not None:
        words |= _record_facts(view.record)
    if verification is not None:
        worst = max(verification.checks, key=lambda check: abs(check.error_mm) / check.limit_mm)
        words["Verified"] = tr("{made_utc}, {error_mm:+.1f} of ±{limit_mm:.1f} µm").format(
            made_utc=local_time(verification.made_utc),
            error_mm=1e3 * worst.error_mm,
            limit_mm=1e3 * worst.limit_mm,
        )
        for name, fact in session_of(verification):
            words["Verified"] += f"; {name.lower()} {fact}"
    return words


def _record_facts(record: CameraRecord) -> dict[str, str]:
    left_out = tr("%n left out", "", len(record.outliers))
    around = "?" if record.temperature_c is None else localised(f"{record.temperature_c:.1f}")
    sensors = "/".join(localised(f"{value:.1f}") for value in record.sensor_temperatures_c) or "?"
    return {
        "Method": record.method,
        "Calibrated": f"{local_time(record.made_utc)}, {record.made_by}",
        "Valid until": local_time(record.valid_until_utc),
        "Positions": f"{record.points}, {left_out}" if record.outliers else f"{record.points}",
        "Residuals": localised(f"{record.rms_px:.4f} px, chi² {record.chi2_per_dof:.2f}"),
        "Warmth": tr("{around} °C, sensors {sensors} °C").format(around=around, sensors=sensors),
        "Artefacts": ", ".join(f"{used.name} {used.serial}" for used in record.artefacts)
        or tr("none"),
    }
