"""Measurement system analysis: random blind plan, progress, and results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtWidgets import QWidget

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.finished import compare_folder, parts_of_batch
from ocmm_core.typed_numbers import PARTS, REFERENCE, SEED, TRIALS
from ocmm_gui import kit
from ocmm_gui.acceptance._start_page import named_field
from ocmm_gui.charts import ComponentsPlot, OperatorsPlot, RunPlot
from ocmm_gui.kit import ActionInfo, later, said, tr, tr_all
from ocmm_gui.wizards.pages import PlotTabs
from ocmm_gui.work import Teller, WorkSheet
from ocmm_shop import studies


@dataclass(frozen=True, slots=True)
class StudyProgress:
    """Progress of a study, and the next measurement; None if complete."""

    measured: int
    following: studies.StudyRun | None


def progress_of(plan: studies.StudyPlan, jobs: Path, tell: Teller) -> StudyProgress:
    """Return the progress without computing results, to keep the study blind."""
    tell(later("Reading the jobs"), 0.2)
    parts = parts_of_batch(jobs, plan.name) if jobs.is_dir() else ()
    left = studies.open_runs(plan, {one.serial for one in parts})
    return StudyProgress(len(plan.runs) - len(left), left[0] if left else None)


def studied(
    plan: studies.StudyPlan, jobs: Path, probes: Path | None, calibrations: Path | None,
    tell: Teller,
) -> studies.StudyReport:  # fmt: skip
    """Return the studies; InputError as `study_jobs`."""
    return studies.study_jobs(plan, jobs, progress=tell, probes=probes, calibrations=calibrations)


@dataclass(frozen=True, slots=True)
class TypeOneStudy:
    """A type-1 study with its values."""

    study: studies.Type1Study
    values: Float
    name: str
    reference: float
    width: float
    simulated: bool


def type_one(
    jobs: Path, name: str, reference: float, probes: Path | None, calibrations: Path | None,
    tell: Teller,
) -> TypeOneStudy:  # fmt: skip
    """Return Cg and Cgk of one characteristic of one part; raise InputError without data.

    `name`: characteristic; empty for the first one of the plan. `reference`: certified value, mm.
    """
    found = compare_folder(jobs, tell, probes=probes, calibrations=calibrations)
    known = [one for one in found.trends if one.name == name or not name]
    if not known:
        names = ", ".join(one.name for one in found.trends)
        raise InputError(
            "msa.name", f"There is no characteristic '{name}'.", f"Give one of {names}."
        )
    trend = known[0]
    width = trend.high - trend.low
    study = studies.type1_study(trend.values, reference, width)
    return TypeOneStudy(study, trend.values, trend.name, reference, width, found.simulated)


KEYS = (
    ActionInfo("draw", later("Draw plan"), later("Draw the order and blind codes, and store them"),
               ("F6",)),
    ActionInfo("plan", later("Open plan"), later("Open the plan of a study"), ("F7",)),
    ActionInfo("jobs", later("Jobs"), later("Choose the folder of the jobs"), ("Shift+F7",)),
    ActionInfo("look", later("Progress"), later("Which measurement comes next"), ("Shift+F6",)),
    ActionInfo("analyse", later("Analyse"), later("Gauge R&R of every characteristic"), ("F8",)),
    ActionInfo("type1", later("Type 1"), later("Cg and Cgk of the selected characteristic"),
               ("F10",)),
    ActionInfo("stop", later("Stop"), later("Stop the analysis"), ("F9",)),
)  # fmt: skip
FIELDS = (
    ("name", later("Study"), later("Name; also the batch of its jobs"), later("STUDY-1")),
    ("parts", later("Parts"), later("How many"), "10"),
    ("operators", later("Operators"), later("Names, parted by commas"), "A,B,C"),
    ("trials", later("Trials"), later("Of each operator on each part"), "3"),
    ("seed", later("Seed"), later("The order is drawn from it"), "1"),
    ("reference", later("Reference, mm"), later("Certified value, for type 1"), ""),
)
COLUMNS = (
    (later("Characteristic"), later("As in the inspection plan")),
    (later("GRR, µm"), later("Standard deviation, with its 90 % interval")),
    (later("% study"), later("GRR of the whole variation")),
    (later("% tol."), later("6 GRR of the tolerance")),
    (later("ndc"), later("Distinct categories")),
    (later("Own U"), later("Scatter found over the uncertainty that is stated")),
    (later("Verdict"), later("AIAG: 10 and 30 %, ndc 5")),
)
MARKS = {"good": kit.Mark.GOOD, "conditional": kit.Mark.DOUBT, "not acceptable": kit.Mark.BAD}


def row_words(one: studies.CharacteristicStudy) -> tuple[str, ...]:
    """Return the row of a characteristic, in the order of `COLUMNS`."""
    study = one.study
    if study is None:
        return (one.name, "–", "–", "–", "–", "–", tr("none"))
    tolerance = study.tolerance_percent
    return (
        one.name,
        kit.localised(
            f"{1e3 * study.grr:.2f} ({1e3 * study.grr_low:.2f}–{1e3 * study.grr_high:.2f})"
        ),
        kit.localised(f"{study.study_percent:.1f}"),
        "–" if tolerance is None else kit.localised(f"{tolerance:.1f}"),
        str(study.ndc),
        "–" if one.stated is None else kit.localised(f"{one.stated.pooled:.2f}"),
        study.word,
    )


class StudySheet(WorkSheet):
    """Plan, progress, table and plots; record folders None are those of this user."""

    def __init__(
        self, folder: Callable[[], Path], probes: Path | None, calibrations: Path | None
    ) -> None:
        super().__init__(tr("Gauge study"), KEYS, tr("Analysing the jobs"))
        self._proposed, self._records = folder, (probes, calibrations)
        self._plan: studies.StudyPlan | None = None
        self._jobs: Path | None = None
        self._report: studies.StudyReport | None = None
        self._type1: TypeOneStudy | None = None
        self.fields = {line[0]: named_field(*line) for line in FIELDS}
        self.store = kit.PathPanel(
            tr("Store the plan in the file"), tr("File of the plan"), tr("Store")
        )
        self.file = kit.PathPanel(tr("Open the plan"), tr("File of the plan"), tr("Open"))
        self.where = kit.PathPanel(tr("Jobs of the study in"), tr("Folder of the jobs"), tr("Use"))
        self.store.given.connect(self.draw)
        self.file.given.connect(self.open_plan)
        self.where.given.connect(self.use_jobs)
        self.word = kit.FitText(tr("Verdict"), limit=30, high=40)
        self.progress = kit.sentence_label(tr("Progress of the study"), 16)
        self.message = kit.sentence_label(tr("What is to be told of the study"), 14)
        self.table = kit.NumberTable(
            tr("Characteristics"), tr_all(COLUMNS), whole=False, font=kit.text_font(14)
        )
        self.table.itemSelectionChanged.connect(self._show_characteristic)
        self.components, self.operators, self.run = ComponentsPlot(), OperatorsPlot(), RunPlot()
        self.tabs = PlotTabs(
            (
                (tr("Components"), self.components),
                (tr("By operator"), self.operators),
                (tr("Type 1"), self.run),
            )
        )
        self._lay_out()
        self.use_keys(
            {
                "draw": lambda: self.store.ask(self._folder() / f"{self._text('name')}.toml"),
                "plan": lambda: self.file.ask(self._folder() / f"{self._text('name')}.toml"),
                "jobs": lambda: self.where.ask(self._folder()),
                "look": self.show_progress,
                "analyse": self.analyse,
                "type1": self.analyse_one,
                "stop": self.stop,
            },
            primary="analyse",
        )
        self.show_message(
            tr("Draw a plan (F6) or open one (F7). The codes are the serial numbers of jobs.")
        )

    def open(self) -> None:
        self.table.setFocus()

    def draw(self, path: Path) -> None:
        """Draw a random plan and store it in a new file."""

        def drawn() -> studies.StudyPlan:
            count = int(kit.read_number(PARTS, self._text("parts")))
            names = [f"{number + 1:0{len(str(count))}}" for number in range(count)]
            operators = [one.strip() for one in self._text("operators").split(",")]
            plan = studies.plan_study(
                self._text("name"),
                names,
                operators,
                int(kit.read_number(TRIALS, self._text("trials"))),
                int(kit.read_number(SEED, self._text("seed"))),
            )
            studies.store_plan(path, plan)
            return plan

        plan = self.attempt(drawn)
        if plan is not None:
            self.told.emit(tr("Plan stored in {path}.").format(path=path))
            self._use(plan)

    def open_plan(self, path: Path) -> None:
        plan = self.attempt(lambda: studies.load_study(path))
        if plan is not None:
            self._use(plan)

    def use_jobs(self, folder: Path) -> None:
        self._jobs = folder
        if self._plan is not None:
            self.show_progress()

    def show_progress(self) -> None:
        plan = self._required()
        if plan is not None:
            self._start(tr("Reading the jobs"), partial(progress_of, plan, self._folder()))

    def analyse(self) -> None:
        """Compute the studies of all characteristics, without blocking."""
        plan = self._required()
        if plan is not None:
            self._start(tr("Analysing"), partial(studied, plan, self._folder(), *self._records))

    def analyse_one(self) -> None:
        """Compute Cg and Cgk of the selected characteristic."""
        reference = self.attempt(lambda: kit.read_number(REFERENCE, self._text("reference")))
        if reference is not None:
            row, name = self.table.currentRow(), ""
            if self._report is not None and row >= 0:
                name = self._report.characteristics[row].name
            work = partial(type_one, self._folder(), name, reference, *self._records)
            self._start(tr("Analysing"), work)

    def _use(self, plan: studies.StudyPlan) -> None:
        self._plan, self._report = plan, None
        for key, text in (
            ("name", plan.name), ("parts", str(len(plan.parts))),
            ("operators", ",".join(plan.operators)), ("trials", str(plan.trials)),
            ("seed", str(plan.seed)),
        ):  # fmt: skip
            self.fields[key].setText(text)
        self.word.show_text("")
        self.message.setText("")
        self.table.setRowCount(0)
        self.show_message(
            tr("{name}: {parts} parts, {operators} operators, {trials} trials").format(
                name=plan.name, parts=len(plan.parts), operators=len(plan.operators),
                trials=plan.trials,
            )
        )  # fmt: skip
        self._show_progress(StudyProgress(0, plan.runs[0]))

    def _show(self, answer: object) -> None:
        if isinstance(answer, StudyProgress):
            self._show_progress(answer)
        elif isinstance(answer, studies.StudyReport):
            self._report = answer
            self._fill(answer)
        elif isinstance(answer, TypeOneStudy):
            self._type1 = answer
            self.run.show_run(answer.study, answer.values, answer.reference, answer.width)
            self.tabs.show_plot(2)
            self.show_message(
                tr("{simulated}{name}: least tolerance {width:.4f} mm").format(
                    simulated=tr("SIMULATED. ") if answer.simulated else "", name=answer.name,
                    width=answer.study.least_tolerance,
                )
            )  # fmt: skip
            mark = kit.Mark.GOOD if answer.study.capable else kit.Mark.BAD
            word = tr("CAPABLE") if answer.study.capable else tr("NOT CAPABLE")
            self.word.show_text(word, mark=mark)

    def _show_progress(self, progress: StudyProgress) -> None:
        plan, following = self._plan, progress.following
        if plan is None:
            return
        said = tr("{done} of {count} measured.").format(
            done=progress.measured, count=len(plan.runs)
        )
        if following is None:
            said += " " + tr("Complete: analyse it (F8).")
        else:
            said += " " + tr("Next: operator {who}, part {part}; serial number {code}.").format(
                who=following.operator, part=following.part, code=following.code
            )
        self.progress.setText(said)

    def _fill(self, report: studies.StudyReport) -> None:
        self.table.blockSignals(True)
        self.table.setRowCount(len(report.characteristics))
        for row, one in enumerate(report.characteristics):
            self.table.show_words(row, row_words(one))
        self.table.blockSignals(False)
        simulated = tr("SIMULATED. ") if report.simulated else ""
        count = len(report.left_out)
        left = tr("%n files left out", "1 file left out", count) if count else ""
        self.show_message(
            tr("{simulated}{done} of {count} measured. {left}").format(
                simulated=simulated, done=report.measured, count=len(report.plan.runs), left=left
            )
        )
        self.progress.setText(
            tr("{done} of {count} measured.").format(
                done=report.measured, count=len(report.plan.runs)
            )
        )
        if report.characteristics:
            self.table.selectRow(0)
        self._show_characteristic()
        self.table.setFocus()

    def _show_characteristic(self) -> None:
        row = self.table.currentRow()
        if self._report is None or not 0 <= row < len(self._report.characteristics):
            return
        one = self._report.characteristics[row]
        self.components.show_study(one.study)
        self.operators.show_values(self._report.plan.operators, one.values)
        stated = one.stated.message if one.stated is not None else ""
        self.message.setText(" ".join(map(said, filter(None, (one.why_not, stated)))))
        word = one.study.word if one.study is not None else tr("NO STUDY")
        mark = MARKS.get(word, kit.Mark.DOUBT)
        self.word.show_text(word.upper(), mark=mark)

    def _required(self) -> studies.StudyPlan | None:
        if self._plan is None:
            self.failed.emit(
                InputError("msa.no_plan", tr("No plan is open."), tr("Draw one (F6) or open it."))
            )
        return self._plan

    def _folder(self) -> Path:
        return self._jobs if self._jobs is not None else self._proposed()

    def _text(self, key: str) -> str:
        return self.fields[key].text().strip()

    def _lay_out(self) -> None:
        form = kit.form_grid(self.fields.values(), across=3)
        form.setHorizontalSpacing(10)
        panels = (self.store, self.file, self.where)
        kit.fill(self.body, *panels, self.working, kit.panel(form), self.progress)
        holder = QWidget()
        kit.vbox(self.word, (self.table, 1), self.message, parent=holder, margins=0)
        self.body.addLayout(
            kit.hbox((holder, 1), (kit.panel(kit.vbox(self.tabs)), 1), spacing=8), 1
        )
