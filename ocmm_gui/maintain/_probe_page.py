"""Probe page: status, tips, and history."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ocmm_core.calibration import records
from ocmm_gui import kit
from ocmm_gui.charts import HistoryChart
from ocmm_gui.kit import later, tr
from ocmm_gui.maintain import _status_page as status_page

_TIPS = (
    (later("Tip"), later("Name; an arrow marks the mounted tip")),
    (later("Standing"), later("Status of the tip")),
    (later("Ball, mm"), later("Effective diameter and its U (k = 2)")),
    (later("Form, µm"), later("Largest minus smallest radius")),
    (later("Cone, µm"), later("Two standard deviations of the tip over all attitudes")),
    (later("Qualified"), later("Date and temperature")),
    (later("Checked"), later("Last quick check since then")),
    (later("Valid until"), later("No points are taken with it after this date")),
)
_HISTORY = (
    (later("Time"), later("Local time")),
    (later("What happened"), later("Record concerned, see the last column")),
    (later("Tip"), later("Its name")),
    (later("Who"), later("As entered")),
    (later("Why"), later("As entered, or the rule applied")),
    (later("Good until"), later("If suspect: last time known good")),
    (later("Record"), later("First digits of its hash")),
)
_TONES = {
    records.TipEventKind.QUALIFIED: "good",
    records.TipEventKind.PASSED: "good",
    records.TipEventKind.NOT_QUALIFIED: "bad",
    records.TipEventKind.FAILED: "bad",
    records.TipEventKind.DOUBTED: "warn",
    records.TipEventKind.MOUNTED: "warn",
}
_STANDING, _ROW_PX = 1, 38
_TIP_TONES = {records.State.VALID: "good", records.State.DUE: "warn"}


class TipTable(kit.DataTable):
    """All tips, the mounted one first; the selected one can be mounted."""

    def __init__(self) -> None:
        super().__init__(tr("Tips"), kit.tr_all(_TIPS))
        self.setAccessibleDescription(tr("Up and down select a tip"))
        self.setFont(kit.text_font(14))
        self.fit_columns(len(_TIPS) - 1)
        self.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.setWordWrap(False)
        self.setMinimumHeight(2 * _ROW_PX + 20)
        self._tips: tuple[records.TipState, ...] = ()

    def chosen(self) -> str | None:
        row = self.currentRow()
        return self._tips[row].tip if 0 <= row < len(self._tips) else None

    def show_tips(self, tips: Sequence[records.TipState]) -> None:
        """Show tips, keeping the selection."""
        chosen = self.chosen()
        self._tips = tuple(tips)
        self.setRowCount(len(tips))
        for row, one in enumerate(tips):
            self.show_words(
                row, _tip_words(one), {_STANDING: _TIP_TONES.get(one.status.state, "bad")}
            )
        names = [one.tip for one in tips]
        if names:
            self.setCurrentCell(names.index(chosen) if chosen in names else 0, 0)


def _tip_words(one: records.TipState) -> tuple[str, ...]:
    found, check = one.qualification, one.check
    name = f"▶ {one.tip}" if one.mounted else f"   {one.tip}"
    until = status_page.local_time(one.due_utc)[:10]
    if found is None:
        return (name, kit.said_word(one.status.state.value), "–", "–", "–", tr("never"), "–", until)
    temperature_state = (
        "" if found.temperature_c is None else kit.localised(f", {found.temperature_c:.1f} °C")
    )
    checked = "–"
    if check is not None:
        verdict = tr("passed") if check.passed else tr("FAILED")
        checked = f"{status_page.local_time(check.made_utc)[:10]} {verdict}"
    return (
        name,
        kit.said_word(one.status.state.value),
        kit.localised(f"{found.diameter_mm:.4f} ± {2.0 * found.diameter_sigma_mm:.4f}"),
        kit.localised(f"{1e3 * found.form_mm:.1f}"),
        kit.localised(f"{1e3 * found.articulation_2s_mm:.1f}"),
        f"{status_page.local_time(found.made_utc)[:10]}{temperature_state}",
        checked,
        until,
    )


def _line(event: records.TipEvent) -> status_page.EventLine:
    kind = event.kind
    word = kit.said_word(kind.value)
    word = word[0].upper() + word[1:]
    if kind in (records.TipEventKind.FAILED, records.TipEventKind.NOT_QUALIFIED):
        word = word.replace("failed", "FAILED")
    cells = (
        status_page.local_time(event.utc),
        word,
        event.tip,
        event.who,
        kit.said(event.reason),
        status_page.local_time(event.since_utc) if event.since_utc else "",
        event.record[:12],
    )
    return status_page.EventLine(cells, _TONES.get(kind, "text"))


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


class ProbePage(status_page.StatusPage[records.ProbeView, records.ProbeOverview]):
    """Status, tips, trends and history of the probe."""

    def __init__(
        self,
        pull: Callable[[], records.ProbeView],
        pull_overview: Callable[[], records.ProbeOverview],
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
        self.history = status_page.EventTable(_HISTORY, toned=(1,), plain=(4,), long=(4,))
        self._charts = status_page.in_a_row(
            *(kit.stacked(one) for one in (self.diameter, self.form, self.place, self.check))
        )
        self._lay_out((self.tips, 2), (self._charts, 4), (self.fault, 2), (self.history, 4))

    def _show_overview(self, view: records.ProbeView, found: records.ProbeOverview) -> None:
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
        self.history.show_lines([_line(event) for event in found.events])
        why = found.fault
        if not why and not found.tips:
            why = tr(_NO_RECORDS if view.word is records.CalibrationStatus.DESIGN else _NO_TIP)
        self.fault.tell(why)
        self._charts.setVisible(bool(found.tips))
        self.tips.setVisible(bool(found.tips))
        self.history.setVisible(bool(found.events))


def _facts(view: records.ProbeView) -> dict[str, str]:
    words = dict.fromkeys((name for name, _ in _FACTS), "–")
    words |= {
        "Probe": view.probe,
        "Tip": view.tip or "–",
        "Ball": kit.localised(f"{view.diameter_mm:.4f} mm"),
        "Hash": view.identity[:12],
    }
    if view.records is None:
        return words
    calibration, qualification = view.records.calibration, view.records.qualification
    made = [calibration] if qualification is None else [calibration, qualification]
    temperature_state = " / ".join(
        "?" if one.temperature_c is None else kit.localised(f"{one.temperature_c:.1f}")
        for one in made
    )
    words |= {
        "Calibrated": f"{status_page.local_time(calibration.made_utc)[:10]}, {calibration.made_by}",
        "Valid until": status_page.local_time(view.due_utc)[:10],
        "Warmth": f"{temperature_state} °C",
        "Turned": "{:.0f}°, {:.0f}°, {:.0f}°".format(*calibration.ranges_deg),
    }
    if qualification is not None:
        words["Qualified"] = (
            f"{status_page.local_time(qualification.made_utc)[:10]}, {qualification.made_by}"
        )
    return words
