"""The probe page: may the tip be trusted, which tips are there, and what happened to them."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QVBoxLayout

from ocmm_core.calibration.records import CalibrationStatus, ProbeOverview, ProbeView
from ocmm_gui.charts import HistoryChart
from ocmm_gui.kit import later, localised, stacked, tr
from ocmm_gui.maintain._calibration_table import local_time
from ocmm_gui.maintain._probe_tables import TipHistoryTable, TipTable
from ocmm_gui.maintain._status_page import StatusPage, in_a_row

DESIGN = later("Virtual probe: the geometry of its document is used.")
_IN_ORDER = later("Calibrated, qualified and in date. Points can be taken.")
_NO_RECORDS = later("No records of this probe are stored on this computer.")
_NO_TIP = later("No tip calibrated yet: press P to calibrate the probe with the mounted tip.")
_FACTS = (
    (later("Probe"), later("name in its document")),
    (later("Tip"), later("currently mounted")),
    (later("Ball"), later("diameter used for compensation")),
    (later("Calibrated"), later("when, and by whom")),
    (later("Qualified"), later("when, and by whom")),
    (later("Valid until"), later("no points are taken after this date")),
    (later("Warmth"), later("ambient, at probe calibration and tip qualification")),
    (later("Turned"), later("rotation about the probe axes during calibration")),
    (later("Hash"), later("of the source of the geometry; printed in jobs and reports")),
)


class ProbePage(StatusPage[ProbeView, ProbeOverview]):
    """Standing, tips, trends and history of the probe.

    Parameters
    ----------
    pull
        Returns what is to be said about the probe now.
    pull_overview
        Returns what its store holds; asked for when the page is opened and when the standing
        changed, for it reads many files.
    """

    def __init__(
        self, pull: Callable[[], ProbeView], pull_overview: Callable[[], ProbeOverview]
    ) -> None:
        super().__init__(
            tr("Probe"),
            tr("Status of the probe"),
            _FACTS,
            pull,
            pull_overview,
            in_order=tr(_IN_ORDER),
            design=tr(DESIGN),
        )
        self.tips = TipTable()
        self.diameter = HistoryChart(tr("Ball diameter, Δ µm"), factor=1e3, reach=2.0)
        self.form = HistoryChart(tr("Form, µm"), factor=1e3, reach=2.0, changes=False, form=".1f")
        self.place = HistoryChart(
            tr("Tip from first position, µm"), factor=1e3, reach=5.0, changes=False, form=".1f"
        )
        self.check = HistoryChart(
            tr("Quick check, % of limit"), factor=100.0, reach=100.0, changes=False, limit=100.0,
            form="+.0f",
        )  # fmt: skip
        self.history = TipHistoryTable()
        self._charts = in_a_row(
            *(stacked(one) for one in (self.diameter, self.form, self.place, self.check))
        )
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addLayout(self._head())
        layout.addWidget(self.tips, 2)
        layout.addWidget(self._charts, 4)
        layout.addWidget(self._empty, 2)
        layout.addWidget(self.history, 4)

    def _show_overview(self, view: ProbeView, found: ProbeOverview) -> None:
        self._show_facts(_facts(view))
        self.tips.show_tips(found.tips)
        trends = found.trends
        for chart, courses in (
            (self.diameter, trends.diameter),
            (self.form, trends.form),
            (self.place, trends.place),
            (self.check, trends.check),
        ):
            chart.show_courses(courses)
        self.history.show_events(found.events)
        why = found.fault
        if not why and not found.tips:
            why = tr(_NO_RECORDS if view.word is CalibrationStatus.DESIGN else _NO_TIP)
        self._show_fault(why)
        self._charts.setVisible(bool(found.tips))
        self.tips.setVisible(bool(found.tips))
        self.history.setVisible(bool(found.events))


def _facts(view: ProbeView) -> dict[str, str]:
    words = dict.fromkeys((name for name, _ in _FACTS), "–")
    words |= {
        "Probe": view.probe,
        "Tip": view.tip or "–",
        "Ball": localised(f"{view.diameter_mm:.4f} mm"),
        "Hash": view.identity[:12],
    }
    if view.records is None:
        return words
    calibration, qualification = view.records.calibration, view.records.qualification
    made = [calibration] if qualification is None else [calibration, qualification]
    temperature_state = " / ".join(
        "?" if one.temperature_c is None else localised(f"{one.temperature_c:.1f}") for one in made
    )
    words |= {
        "Calibrated": f"{local_time(calibration.made_utc)[:10]}, {calibration.made_by}",
        "Valid until": local_time(view.due_utc)[:10],
        "Warmth": f"{temperature_state} °C",
        "Turned": "{:.0f}°, {:.0f}°, {:.0f}°".format(*calibration.ranges_deg),
    }
    if qualification is not None:
        words["Qualified"] = f"{local_time(qualification.made_utc)[:10]}, {qualification.made_by}"
    return words
