"""Page of a planned rig: U over its volume, places of its cameras, and the rig as calibrated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
from PySide6.QtWidgets import QGridLayout, QWidget

from ocmm_core import measuring
from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.export import write_together
from ocmm_core.typed_numbers import PLACEMENTS
from ocmm_gui import kit
from ocmm_gui.charts import MapPlot
from ocmm_gui.kit import later, said, tr
from ocmm_gui.maintain._computed_page import ComputedPage
from ocmm_gui.work import Teller, Work
from ocmm_planner import (
    RigSheet,
    evaluate_plan,
    load_rig_plan,
    maps_of,
    sheet_sentences,
    shopping_list,
)

_ASK = later("Press Predict. A search takes minutes; measuring continues meanwhile.")
_STEP = later("Predicting the rig")
_OTHER = later("The cameras of this machine are not those of the plan, and are not compared.")
_FIELDS = (
    ("plan", later("Rig plan"), later("Rig plan; empty: the rig of the thesis"), ""),
    ("search", later("Placements"), later("Placements tried by the search; 0: no search"), "0"),
    (
        "out", later("Write to"),
        later("Folder for the sheet (PDF) and its data (JSON); empty: not written"), "",
    ),
)  # fmt: skip
_EMPTY = {"plan": later("the rig of the thesis"), "out": later("not written")}
_SEED = 1
_COLUMNS = (
    (later("Camera"), later("name in the plan")),
    ("X", later("of the projection centre, mm")),
    ("Y", later("of the projection centre, mm")),
    ("Z", later("of the projection centre, mm")),
    (later("Azimuth °"), later("of the view, from +Y towards +X")),
    (later("Elevation °"), later("of the view, upwards")),
    (later("Roll °"), later("about the optical axis")),
)


@dataclass(frozen=True, slots=True)
class RigPlanRequest:
    """A plan, the rig to compare it with, the trials of the search, and where to write."""

    plan: Path
    rig: Rig
    search: int
    out: Path | None
    language: str


@dataclass(frozen=True, slots=True)
class RigPlanAnswer:
    """The prediction, whether the rig is that of the plan, and the written files."""

    sheet: RigSheet
    described: bool
    written: tuple[Path, ...]


def predict_request(request: RigPlanRequest, tell: Teller) -> RigPlanAnswer:
    """Return the prediction, in a separate process. Raise InputError as the documents do."""
    plan = load_rig_plan(request.plan)
    described = plan.describes(request.rig)
    sheet = evaluate_plan(
        plan, seed=_SEED, evaluations=request.search,
        calibrated=request.rig if described else None,
        step=lambda share: tell(_STEP, share),
    )  # fmt: skip
    if request.out is None:
        return RigPlanAnswer(sheet, described, ())
    from ocmm_gui.reports import drawing, rig_sheet_pdf

    with drawing():
        pdf = rig_sheet_pdf(sheet, request.language)
    stem = request.out / f"{request.plan.stem}_rig"
    files = {stem.with_suffix(".json"): msgspec.json.encode(sheet), stem.with_suffix(".pdf"): pdf}
    tell.commit()
    write_together(files)
    return RigPlanAnswer(sheet, described, tuple(files))


class RigPlanPage(ComputedPage):
    """Predicted U of a rig before it is bought, and of this one as calibrated."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(tr("Planned rig"), _FIELDS, _EMPTY, tr("Predict"), tr(_ASK))
        self._rig = rig
        self.number = kit.FitText(tr("Worst U of the tip"), limit=40, digits=True, high=48)
        self.places = kit.NumberTable(tr("Places of the cameras"), kit.tr_all(_COLUMNS))
        self.places.right_heads(range(1, len(_COLUMNS)))
        self.maps = tuple(
            MapPlot(tr(name))
            for name in (
                later("From above"), later("From the front"),
                later("Calibrated: above"), later("Calibrated: front"),
            )
        )  # fmt: skip
        self._compared = [kit.panel(kit.vbox(plot)) for plot in self.maps]
        told = QWidget()
        kit.vbox(self._sentence, 1, parent=told, margins=0)
        found = kit.vbox(self.number, (kit.scrolled(told), 1))
        left = kit.vbox(kit.panel(self._form()), (kit.panel(found), 1), spacing=8)
        plots = QGridLayout()
        plots.setSpacing(8)
        for index, plot in enumerate(self._compared):
            plots.addWidget(plot, index // 2, index % 2)
        right = kit.vbox((plots, 1), self.places, spacing=8)
        kit.hbox((left, 4), (right, 7), parent=self, spacing=8, margins=0)
        # Without a parent each would be a window.
        for plot in self._compared[2:]:
            plot.hide()

    def summary(self) -> str:
        return self._sentence.text()

    def _work(self) -> Work:
        words = self._words()
        plan, out = words["plan"], words["out"]
        request = RigPlanRequest(
            Path(plan).expanduser() if plan else resource("rig_plans", "thesis.toml"), self._rig,
            int(kit.read_number(PLACEMENTS, words["search"])),
            Path(out).expanduser() if out else None, kit.language_in_use(),
        )  # fmt: skip
        return partial(predict_request, request)

    def _show_report(self, report: object) -> None:
        assert isinstance(report, RigPlanAnswer)  # noqa: S101 - of `predict_request`
        sheet = report.sheet
        worst = sheet.best.worst_um
        whole = sheet.best.measurable == sheet.best.nodes
        told = [said(sentence) for sentence in sheet_sentences(sheet)]
        if not report.described:
            told.append(tr(_OTHER))
        told += [tr("To buy: {articles}").format(articles=", ".join(shopping_list(sheet)))]
        if report.written:
            told.append(tr("Written: {files}").format(files=", ".join(map(str, report.written))))
        if worst is None:
            self.number.show_text("–", "bad")
        else:
            text = tr("U {worst:.1f} µm, median {median:.1f}").format(
                worst=worst, median=sheet.best.median_um
            )
            self.number.show_text(text, "text" if whole else "warn")
        self._sentence.setText("\n\n".join(told))
        rows = [
            (one.name, *one.centre, one.azimuth_deg, one.elevation_deg, one.roll_deg)
            for one in sheet.cameras
        ]
        self.places.show_rows(
            [(name, *(kit.localised(f"{value:.1f}") for value in values)) for name, *values in rows]
        )
        for row in range(len(rows)):
            self.places.show_digits(row, range(1, len(_COLUMNS)), 15)
        maps = maps_of(sheet)
        limits = measuring.map_range(maps)
        for index, (plot, shown) in enumerate(zip(self.maps, self._compared, strict=True)):
            shown.setVisible(index < len(maps))
            if index < len(maps):
                plot.show_map(maps[index], limits)
