"""Measurement system analysis: random blind plan, progress, and results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QHBoxLayout, QHeaderView, QVBoxLayout, QWidget

from ocmm_core.errors import InputError
from ocmm_core.studies import StudyPlan, StudyReport, load_study, plan_study, store_plan
from ocmm_gui.acceptance._study_parts import (
    COLUMNS,
    KEYS,
    MARKS,
    fields_of_study,
    length_mm,
    row_words,
    whole_number,
)
from ocmm_gui.acceptance._study_work import Analysing, AnalysingOne, Looking, StudyProgress, TypeOne
from ocmm_gui.charts import ComponentsPlot, OperatorsPlot, RunPlot
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    FitText,
    FormField,
    Mark,
    NumberTable,
    PathPanel,
    Theme,
    mark_colour,
    panel,
    said,
    sentence_label,
    text_font,
    tr,
    tr_all,
)
from ocmm_gui.wizards.parts import PlotTabs
from ocmm_gui.work import WorkSheet


class StudySheet(WorkSheet):
    """Plan, progress, table and plots.

    `probes`, `calibrations`: Record folders; None for this user's.
    """

    def __init__(
        self, folder: Callable[[], Path], probes: Path | None, calibrations: Path | None
    ) -> None:
        super().__init__(tr("Gauge study"), KEYS, tr("Analysing the jobs"))
        self._proposed, self._records = folder, (probes, calibrations)
        self._theme = THEMES[DEFAULT_THEME]
        self._plan: StudyPlan | None = None
        self._jobs: Path | None = None
        self._report: StudyReport | None = None
        self._type1: TypeOne | None = None
        self.fields: dict[str, FormField] = {}
        self.store = PathPanel(
            tr("Store the plan in the file"), tr("File of the plan"), tr("Store")
        )
        self.file = PathPanel(tr("Open the plan"), tr("File of the plan"), tr("Open"))
        self.where = PathPanel(tr("Jobs of the study in"), tr("Folder of the jobs"), tr("Use"))
        self.store.given.connect(self.draw)
        self.file.given.connect(self.open_plan)
        self.where.given.connect(self.use_jobs)
        self.word = FitText(tr("Verdict"), limit=30)
        self.word.setFixedHeight(40)
        self.progress = sentence_label(tr("Progress of the study"), 16)
        self.message = sentence_label(tr("What is to be told of the study"), 14)
        self.table = NumberTable(
            tr("Characteristics"), tr_all(COLUMNS), whole=False, font=text_font(14)
        )
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
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
                "look": self.look,
                "analyse": self.analyse,
                "type1": self.analyse_one,
                "stop": self.stop,
            },
            primary="analyse",
        )
        self.say(tr("Draw a plan (F6) or open one (F7). The codes are the serial numbers of jobs."))

    def open(self) -> None:
        self.table.setFocus()

    def draw(self, path: Path) -> None:
        """Draw a random plan and store it in a new file."""

        def drawn() -> StudyPlan:
            count = whole_number("parts", self._text("parts"))
            names = [f"{number + 1:0{len(str(count))}}" for number in range(count)]
            operators = [one.strip() for one in self._text("operators").split(",")]
            plan = plan_study(
                self._text("name"),
                names,
                operators,
                whole_number("trials", self._text("trials")),
                whole_number("seed", self._text("seed")),
            )
            store_plan(path, plan)
            return plan

        plan = self.attempt(drawn)
        if plan is not None:
            self.told.emit(tr("Plan stored in {path}.").format(path=path))
            self._use(plan)

    def open_plan(self, path: Path) -> None:
        plan = self.attempt(lambda: load_study(path))
        if plan is not None:
            self._use(plan)

    def use_jobs(self, folder: Path) -> None:
        """Set the job folder, and read the progress."""
        self._jobs = folder
        if self._plan is not None:
            self.look()

    def look(self) -> None:
        plan = self._required()
        if plan is not None:
            self._begin(tr("Reading the jobs"), Looking(plan, self._folder()))

    def analyse(self) -> None:
        """Compute the studies of all characteristics, without blocking."""
        plan = self._required()
        if plan is not None:
            self._begin(tr("Analysing"), Analysing(plan, self._folder(), *self._records))

    def analyse_one(self) -> None:
        """Compute Cg and Cgk of the selected characteristic."""
        reference = self.attempt(lambda: length_mm("reference", self._text("reference")))
        if reference is not None:
            row, name = self.table.currentRow(), ""
            if self._report is not None and row >= 0:
                name = self._report.characteristics[row].name
            work = AnalysingOne(self._folder(), name, reference, *self._records)
            self._begin(tr("Analysing"), work)

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._show_characteristic()

    def _use(self, plan: StudyPlan) -> None:
        self._plan, self._report = plan, None
        self.table.setRowCount(0)
        self.say(
            tr("{name}: {parts} parts, {operators} operators, {trials} trials").format(
                name=plan.name, parts=len(plan.parts), operators=len(plan.operators),
                trials=plan.trials,
            )
        )  # fmt: skip
        self._show_progress(StudyProgress(0, plan.runs[0]))

    def _show(self, answer: object) -> None:
        self.show_answer(answer)

    def show_answer(self, answer: object) -> None:
        """Show progress, results, or a type-1 study."""
        if isinstance(answer, StudyProgress):
            self._show_progress(answer)
        elif isinstance(answer, StudyReport):
            self._report = answer
            self._fill(answer)
        elif isinstance(answer, TypeOne):
            self._type1 = answer
            self.run.show_run(answer.study, answer.values, answer.reference, answer.width)
            self.tabs.show_plot(2)
            self.say(
                tr("{simulated}{name}: least tolerance {width:.4f} mm").format(
                    simulated=tr("SIMULATED. ") if answer.simulated else "", name=answer.name,
                    width=answer.study.least_tolerance,
                )
            )  # fmt: skip
            mark = Mark.GOOD if answer.study.capable else Mark.BAD
            word = tr("CAPABLE") if answer.study.capable else tr("NOT CAPABLE")
            self.word.show_text(word, mark_colour(self._theme, mark), mark)

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

    def _fill(self, report: StudyReport) -> None:
        self.table.blockSignals(True)
        self.table.setRowCount(len(report.characteristics))
        for row, one in enumerate(report.characteristics):
            self.table.show_words(row, row_words(one))
        self.table.blockSignals(False)
        simulated = tr("SIMULATED. ") if report.simulated else ""
        count = len(report.left_out)
        left = tr("%n files left out", "1 file left out", count) if count else ""
        self.say(
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
        mark = MARKS.get(word, Mark.DOUBT)
        self.word.show_text(word.upper(), mark_colour(self._theme, mark), mark)

    def _required(self) -> StudyPlan | None:
        if self._plan is None:
            self.failed.emit(
                InputError("msa.no_plan", tr("No plan is open."), tr("Draw one (F6) or open it."))
            )
        return self._plan

    def _folder(self) -> Path:
        return self._jobs if self._jobs is not None else self._proposed()

    def _text(self, key: str) -> str:
        text: str = self.fields[key].text()
        return text.strip()

    def _lay_out(self) -> None:
        for widget in (self.store, self.file, self.where, self.working):
            self.body.addWidget(widget)
        self.body.addWidget(panel(fields_of_study(self.fields)))
        self.body.addWidget(self.progress)
        left = QVBoxLayout()
        left.addWidget(self.word)
        left.addWidget(self.table, 1)
        left.addWidget(self.message)
        holder = QWidget()
        left.setContentsMargins(0, 0, 0, 0)
        holder.setLayout(left)
        right = QVBoxLayout()
        right.addWidget(self.tabs)
        middle = QHBoxLayout()
        middle.setSpacing(8)
        middle.addWidget(holder, 1)
        middle.addWidget(panel(right), 1)
        self.body.addLayout(middle, 1)
