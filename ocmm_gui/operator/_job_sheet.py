"""Start of a job: operator, part, and open jobs."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from itertools import zip_longest
from pathlib import Path

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QCompleter, QLineEdit, QListWidget, QListWidgetItem

from ocmm_core.ambient import TypedRoom
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.evaluation import JobHeader, JobView
from ocmm_core.inspection.finished import BatchPart, next_serial, parts_of_batch
from ocmm_core.inspection.plan import PlanSummary, list_plans, plan_card
from ocmm_gui import kit
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import later, tr
from ocmm_gui.work import Worker, WorkLine

_KEYS = (
    kit.ActionInfo(
        "next_part", later("Next part"), later("Next serial number, all other fields unchanged",
    ),
               ("F6",)),
    kit.ActionInfo("plan", later("Other plan"), later("Choose another plan file"), ("F9",)),
    kit.ActionInfo("go_on", later("Continue"), later("Resume the selected job"), ("F7",)),
    kit.ActionInfo("begin", later("Start"), later("Start a job for this part"), ("F8",)),
)  # fmt: skip
_FIELDS = (
    ("operator", later("Operator"), later("Name of the operator")),
    ("serial", later("Serial number"), later("Of the part; - if it has none")),
    ("order", later("Order no."), later("Order number; optional")),
    ("batch", later("Batch"), later("Groups parts for comparison; optional")),
)
_ROOM = (
    ("room", later("Room, °C"), later("A number or a range")),
    ("humidity", later("Humidity, %"), later("optional")),
    ("pressure", later("Pressure, hPa"), later("optional; Return keeps all three")),
)
_PATH = Qt.ItemDataRole.UserRole
_ROW_PX = 44


class JobSheet(kit.Sheet):
    """Four fields beside the jobs of the batch; Return moves on, and starts the job."""

    def __init__(self, bridge: StationBridge) -> None:
        super().__init__(tr("Job"), _KEYS)
        self._bridge = bridge
        self.fields = self._form(_FIELDS, self.start)
        self.room = self._form(_ROOM, self.note_room)
        # A folder may hold many files on a slow disk.
        self._lists = Worker("ocmm-lists", self)
        self._offered: dict[Path, PlanSummary] = {}
        self._beside: dict[Path, PlanSummary] = {}
        self.work = WorkLine(tr("Job"))
        bridge.jobs.job_begun.connect(self.work.end)
        bridge.failed.connect(self._on_failed)
        self._cards: list[PlanSummary | None] = [None]
        self.plans = kit.ChoiceBox(tr("Plan"), tr("Plan of the next job"), ())
        kit.dressed(self.plans, font=kit.text_font(18), high=44)
        self.plans.currentIndexChanged.connect(lambda _row: self._show_part())
        self.plan_file = kit.PathPanel(
            tr("Choose the plan from the file"), tr("File of the plan"), tr("Choose")
        )
        self.plan_file.given.connect(self.choose_plan)
        kit.fill(self.body, self.plan_file, self.work)
        for field in self.fields.values():
            kit.dressed(field, font=kit.text_font(20), high=44)
        grid = kit.form_grid((self.plans, *self.fields.values()), first=1, pixels=18)
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(12)
        self._part = kit.dressed(kit.PlainLabel(), tr("Part"), font=kit.text_font(20, bold=True))
        grid.addWidget(self._part, 0, 0, 1, 2)
        words = tr(
            "Return moves to the next field and, after the last one, starts the job. "
            "Unfinished jobs are saved with all their points and paused when the next job has "
            "another plan; choose Continue to resume."
        )
        hint = kit.sentence_label(tr("What to do next"), 14, words, role="muted")
        grid.addWidget(hint, len(_FIELDS) + 2, 0, 1, 2)
        grid.setRowStretch(len(_FIELDS) + 3, 1)
        tip = tr("Up and down select a job; F7 resumes it")
        self.jobs = kit.dressed(
            QListWidget(), tr("Jobs of this batch"), tip, font=kit.text_font(15)
        )
        self._heading = kit.sentence_label(tr("Which jobs"), 15)
        room = kit.form_grid(self.room.values())
        self._kept = kit.sentence_label(tr("What the job keeps of the room"), 14)
        room.addWidget(self._kept, len(_ROOM), 0, 1, 2)
        bridge.job_changed.connect(self._show_room)
        beside = kit.vbox(self._heading, (self.jobs, 1), room)
        self.body.addLayout(kit.hbox((kit.panel(grid), 1), (kit.panel(beside), 1), spacing=12), 1)
        self.fields["batch"].editingFinished.connect(self._list_jobs)
        self.jobs.itemActivated.connect(lambda _item: self.go_on())
        self.use_keys(
            {
                "next_part": self.next_part,
                "plan": lambda: self.plan_file.ask(self._plan_folder()),
                "go_on": self.go_on,
                "begin": self.start,
            },
            primary="begin",
        )

    def _form(
        self, lines: Sequence[tuple[str, str, str]], end: Callable[[], None]
    ) -> dict[str, kit.FormField]:
        """Return fields by key; Return moves on, and calls ``end`` after the last one."""
        fields = {key: kit.form_field(tr(label), tr(tip)) for key, label, tip in lines}
        for field, after in zip_longest(fields.values(), tuple(fields.values())[1:]):
            field.returnPressed.connect(end if after is None else partial(_enter, after))
            field.left.connect(self.left)
        return fields

    def note_room(self) -> None:
        """Store the typed conditions in the current job; the core determines start or end."""
        typed = TypedRoom(**{key: field.text() for key, field in self.room.items()})

        def kept() -> None:
            for field in self.room.values():
                field.clear()

        self._bridge.job.note_room(typed, kept)

    def _show_room(self, job: JobView) -> None:
        told = [sentence for _, sentence in job.room]
        if job.room_doubt:
            told.append(job.room_doubt)
        nothing = tr("Current job: nothing was read off in the room.")
        self._kept.setText(kit.said(" ".join(told)) if told else nothing)

    def open(self, job: JobView) -> None:
        """Fill in known values, with the focus in the first field."""
        header = self._proposal(job)
        self._list_plans()
        self.show_message(tr("Current job: {job}.").format(job=job.job))
        for key, field in self.fields.items():
            field.setText(str(getattr(header, key)))
        self._list_jobs()
        self._show_room(job)
        self.fields["operator"].setFocus()
        self.fields["operator"].selectAll()

    def start(self) -> None:
        words = {key: field.text().strip() for key, field in self.fields.items()}
        header = JobHeader(part=self._bridge.station.job.plan.part, **words)
        card = self._cards[self.plans.currentIndex()]
        if card is None:
            self._bridge.jobs.next_part(header)
        else:
            self._bridge.jobs.change_plan(card.path, header)
        self._show_beginning()

    def offer(self, path: Path) -> None:
        """Offer a plan; report one that cannot be measured."""
        card = self.attempt(lambda: plan_card(path))
        if card is not None:
            self._offered[path.absolute()] = card
            self._show_plans()

    def choose_plan(self, path: Path) -> None:
        """Select the plan of a file for the next job."""
        self.offer(path)
        if path.absolute() in self._offered:
            self._choose(path.absolute())
            self.plans.setFocus()

    def propose_operators(self, names: tuple[str, ...]) -> None:
        """Set completion names for the operator field."""
        completer = QCompleter(names, self.fields["operator"])
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.fields["operator"].setCompleter(completer)

    def next_part(self) -> None:
        header = self.attempt(lambda: _after(self._bridge.shown.job.header))
        if header is not None:
            self._bridge.jobs.next_part(header)
            self._show_beginning()

    def go_on(self) -> None:
        """Resume the selected job, once the list is read."""
        self._lists.do(lambda: None, lambda _none: self._go_on(), self.failed.emit)

    def close_work(self) -> None:
        self._lists.close(0.0)

    def _go_on(self) -> None:
        item = self.jobs.currentItem()
        if item is None:
            self.told.emit(tr("Select a job in the list first."))
        else:
            self._bridge.jobs.go_on(item.data(_PATH))
            self._show_beginning()

    def _show_beginning(self) -> None:
        if self._bridge.jobs.is_beginning():
            self.work.start(tr("Starting the job"))

    def _on_failed(self, _error: object) -> None:
        if not self._bridge.jobs.is_beginning():
            self.work.end()

    def _proposal(self, job: JobView) -> JobHeader:
        """Return the header of the running job, or of the next part once it has points."""
        if not any(feature.points for feature in job.features):
            return job.header
        try:
            return _after(job.header)
        except OcmmError:
            return job.header

    def _plan_folder(self) -> Path:
        file = self._bridge.station.job.plan_file
        return Path.home() if file is None else file.parent

    def _list_plans(self) -> None:
        """List the current plan, its siblings, and offered ones."""
        file, offered = self._bridge.station.job.plan_file, tuple(self._offered)
        folder = self._plan_folder()
        self._show_plans()

        def read() -> tuple[dict[Path, PlanSummary], dict[Path, PlanSummary]]:
            # Keep the current plan selectable.
            asked = {*offered, *([] if file is None else [file.absolute()])}
            found = {}
            for path in sorted(asked):
                # Omit plans that became unreadable.
                with contextlib.suppress(OcmmError):
                    found[path] = plan_card(path)
            return {card.path: card for card in list_plans(folder)}, found

        def done(answer: tuple[Mapping[Path, PlanSummary], Mapping[Path, PlanSummary]]) -> None:
            beside, found = answer
            late = {path: card for path, card in self._offered.items() if path not in offered}
            self._beside, self._offered = dict(beside), {**found, **late}
            self._show_plans()

        self._lists.do(read, done, self.failed.emit)

    def _show_plans(self) -> None:
        station, before = self._bridge.station, self._cards[max(self.plans.currentIndex(), 0)]
        known = {**self._beside, **self._offered}
        others = [card for card in known.values() if card.identity != station.job.plan_identity]
        self._cards = [None, *others]
        self.plans.blockSignals(True)
        self.plans.clear()
        self.plans.addItem(tr("{name} (current job)").format(name=station.job.plan.name))
        for card in others:
            changed = ", " + tr("changed since") if card.path == station.job.plan_file else ""
            remarks = ", ".join(map(kit.said, card.remarks))
            self.plans.addItem(f"{card.name}, {card.path.name}{changed}, {remarks}")
            self.plans.setItemData(
                self.plans.count() - 1, kit.literal(str(card.path)), Qt.ItemDataRole.ToolTipRole
            )
        self.plans.blockSignals(False)
        if before is not None:
            self._choose(before.path)
        self._show_part()

    def _choose(self, path: Path) -> None:
        # The plan in use is entry 0, without a card.
        places = [None if card is None else card.path for card in self._cards]
        self.plans.setCurrentIndex(places.index(path) if path in places else 0)

    def _show_part(self) -> None:
        card = self._cards[max(self.plans.currentIndex(), 0)]
        part = self._bridge.station.job.plan.part if card is None else card.part
        self._part.setText(tr("Part {part}").format(part=part))

    def _list_jobs(self) -> None:
        batch = self.fields["batch"].text().strip()
        folder = self._bridge.station.job.path.parent
        self._heading.setText(tr("Reading jobs in {folder}").format(folder=folder))
        self._lists.do(
            lambda: parts_of_batch(folder, batch),
            lambda parts: self._show_jobs(folder, batch, parts),
            self.failed.emit,
        )

    def _show_jobs(self, folder: Path, batch: str, parts: tuple[BatchPart, ...]) -> None:
        if batch != self.fields["batch"].text().strip():
            # Another batch was selected meanwhile.
            return
        running = self._bridge.station.job.path
        self.jobs.clear()
        for part in reversed(parts):
            if part.path == running:
                continue
            when = kit.time_words(datetime.fromisoformat(part.created_utc))
            item = QListWidgetItem(
                tr("Serial {serial}: {points}, {operator}, {when} UTC, {name}").format(
                    serial=part.serial,
                    points=tr("%n points", "1 point", part.points),
                    operator=part.operator,
                    when=when,
                    name=part.path.name,
                ),
                self.jobs,
            )
            item.setData(_PATH, part.path)
            item.setToolTip(kit.literal(item.text()))
            item.setSizeHint(QSize(200, _ROW_PX))
        if self.jobs.count():
            self.jobs.setCurrentRow(0)
        of = tr("of batch {batch}").format(batch=batch) if batch else tr("without a batch")
        count = self.jobs.count() or tr("none")
        self._heading.setText(
            tr("Other jobs {of}, in {folder}: {count}").format(of=of, folder=folder, count=count)
        )


def _enter(field: QLineEdit) -> None:
    """Focus a field as Tab does: typing replaces its content."""
    field.setFocus(Qt.FocusReason.TabFocusReason)


def _after(header: JobHeader) -> JobHeader:
    """Return the header of the next part; InputError if its serial has no number."""
    return replace(header, serial=next_serial(header.serial))
