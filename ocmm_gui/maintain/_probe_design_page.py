"""Page of the probe's design: tip uncertainty with this rig, and its causes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QGridLayout

from ocmm_core import measuring
from ocmm_core.calibration.probe_design import Postures, load_design, shipped_design
from ocmm_core.calibration.records import ProbeInUse, probe_from_records
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_core.typed_numbers import SPOT_NOISE, TILT, NumberField
from ocmm_gui import kit
from ocmm_gui.charts import BendingPlot, MapPlot
from ocmm_gui.kit import later, tr
from ocmm_gui.maintain._computed_page import ComputedPage
from ocmm_gui.work import Tell, Work

_ASK = later("Press Examine. It takes a few seconds; measuring continues meanwhile.")
_FIELDS = (
    ("probe", later("Probe"), later("Probe document; empty: the probe in use"), ""),
    (
        "design", later("Design"),
        later("Design document (materials, sections); empty: the one in the resources folder"), "",
    ),
    ("tilt", later("Tilts, °"), later("Largest tilts of the probe about X, Y and Z"), "45 45 10"),
    ("sigma", later("Spots, px"), later("Noise of an averaged spot"), "0.0105"),
)  # fmt: skip
_EMPTY = {"probe": later("the probe in use"), "design": later("the one in the resources folder")}
"""Meaning of empty fields."""
_COLUMNS = (
    (later("Source"), later("of the uncertainty of one point")),
    ("µm", later("standard uncertainty in space, RMS over the poses")),
    (later("Rests on"), later("source values")),
)


@dataclass(frozen=True, slots=True)
class DesignRequest:
    """The rig with the probe in use, or with the documents of another one."""

    rig: Rig
    body: ProbeBody
    probe: Path | None
    design: Path | None
    asked: measuring.Examination


def examine_request(request: DesignRequest, tell: Tell) -> measuring.ProbeReport:
    """Return the report, in a separate process. Raise InputError as the documents do."""
    body = request.body if request.probe is None else load_probe(request.probe)
    path = request.design if request.design is not None else shipped_design(body)
    design = None if path is None else load_design(path, body)
    return measuring.examine(request.rig, body, design, request.asked, tell)


def plain_body(probe: ProbeInUse) -> ProbeBody:
    """Return a probe from its records or document, without temperature compensation."""
    if probe.records is None:
        return probe.design
    records = probe.records
    return probe_from_records(probe.design, records.calibration, records.qualification)


class ProbeDesignPage(ComputedPage):
    """Uncertainty, maps, labels, mechanics and budget of a probe, computed on request."""

    def __init__(self, rig: Rig, body: ProbeBody) -> None:
        super().__init__(tr("Design of the probe"), _FIELDS, _EMPTY, tr("Examine"), tr(_ASK))
        self._rig, self._body = rig, body
        self.number = kit.FitText(tr("Uncertainty of the tip"), limit=40, digits=True, high=48)
        self._labels = kit.FitText(tr("Labels"), limit=17, high=24)
        self._nearest = kit.sentence_label(tr("Nearest wrong orders"), 13)
        self._mechanics = kit.sentence_label(tr("Growth and bending"), 13)
        self.budget = PointBudgetTable()
        self.tilt = MapPlot(tr("Over the tilt"))
        self.top = MapPlot(tr("From above"))
        self.front = MapPlot(tr("From the front"))
        self.bending = BendingPlot()
        self._lay_out()

    def summary(self) -> str:
        parts = (self._sentence, self._nearest, self._mechanics)
        return "\n".join([self._labels.text(), *(part.text() for part in parts)])

    def _work(self) -> Work:
        return partial(examine_request, self._request())

    def _request(self) -> DesignRequest:
        words = self._words()
        tilt = tuple(_numbers(TILT, tr("Tilts"), words["tilt"], 3))
        (sigma,) = _numbers(SPOT_NOISE, tr("Spots"), words["sigma"], 1)
        asked = measuring.Examination(Postures((tilt[0], tilt[1], tilt[2]), self._rig.volume_world))
        return DesignRequest(
            self._rig,
            self._body,
            Path(words["probe"]) if words["probe"] else None,
            Path(words["design"]) if words["design"] else None,
            replace(asked, sigma_px=sigma),
        )

    def _show_report(self, report: object) -> None:
        assert isinstance(report, measuring.ProbeReport)  # noqa: S101 - of `examine_request`
        safe = report.coded or all(item.is_safe for item in report.labels)
        self._labels.show_text(
            tr("LEDs cannot be confused") if safe else tr("LEDs can be confused"),
            mark=kit.Mark.GOOD if safe else kit.Mark.BAD,
        )
        number = report.number
        if np.isfinite(number.space_um):
            self.number.show_text(kit.localised(f"{number.space_um:.1f} µm"))
            x, y, z = number.axes_um
            self._sentence.setText(
                tr(
                    "Standard uncertainty of the tip in space from spot noise alone, probe "
                    "'{probe}' with rig '{rig}': X {x:.1f}, Y {y:.1f}, Z {z:.1f} µm; below "
                    "{p95_um:.1f} µm in 95 of 100 poses. {share:.0f} % of the poses give a tip."
                ).format(
                    probe=report.probe,
                    rig=report.rig,
                    x=x,
                    y=y,
                    z=z,
                    p95_um=number.p95_um,
                    share=100.0 * number.share,
                )
            )
        else:
            self.number.show_text("–", "bad")
            self._sentence.setText(tr("No pose gives a tip: the cameras do not see enough LEDs."))
        # The worst case represents all; the terminal prints each of them.
        nearest = min(
            report.labels,
            key=lambda item: np.inf if item.ambiguity is None else item.ambiguity.residual_mm,
        )
        verdict = measuring.label_verdict(report.labels, coded=report.coded)
        self._nearest.setText(f"{measuring.label_words(nearest)} {verdict}")
        self._mechanics.setText(
            tr("Thermal growth and bending need a design document.")
            if report.mechanics is None
            else "\n".join(measuring.mechanics_words(report.mechanics))
        )
        self.budget.show_terms(report.budget)
        limits = measuring.map_range(report.maps)
        for plot, found in zip((self.tilt, self.top, self.front), report.maps, strict=True):
            plot.show_map(found, limits)
        self.bending.show_mechanics(report.mechanics)

    def _lay_out(self) -> None:
        said = kit.vbox(
            self.number, self._sentence, self._labels, self._nearest, self._mechanics, 1
        )
        left = kit.vbox(kit.panel(self._form()), (kit.panel(said), 1), spacing=8)
        plots = QGridLayout()
        plots.setSpacing(8)
        for index, plot in enumerate((self.tilt, self.bending, self.top, self.front)):
            plots.addWidget(kit.panel(kit.vbox(plot)), index // 2, index % 2)
        right = kit.vbox((plots, 1), self.budget, spacing=8)
        kit.hbox((left, 4), (right, 7), parent=self, spacing=8, margins=0)


class PointBudgetTable(kit.DataTable):
    """Uncertainty sources of one point."""

    def __init__(self) -> None:
        super().__init__(tr("Budget of one point"), kit.tr_all(_COLUMNS))
        self.horizontalHeader().setStretchLastSection(True)
        self.verticalHeader().setDefaultSectionSize(20)
        self.setWordWrap(False)
        self.setFixedHeight(196)

    def show_terms(self, terms: tuple[measuring.BudgetTerm, ...]) -> None:
        self.setRowCount(len(terms))
        for row, term in enumerate(terms):
            sigma = kit.localised(f"{term.sigma_um:.2f}")
            self.show_words(row, (term.name, sigma, term.rests_on))
            self._cell(row, 1).setTextAlignment(kit.RIGHT)
        self._fit()

    def _paint(self) -> None:
        super()._paint()
        self._fit()

    def _fit(self) -> None:
        for column in (0, 1):
            self.resizeColumnToContents(column)


def _numbers(field: NumberField, what: str, text: str, count: int) -> list[float]:
    words = text.replace(";", " ").split()
    if len(words) != count:
        raise InputError(
            "design.number",
            f"Field '{what}' is {text!r}; it needs {count} number(s).",
            "Enter numbers separated by spaces.",
        )
    return [kit.read_number(field, word) for word in words]
