"""Artefact register: entries, expiry, refusals, and a form, typed or read from a certificate."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Literal, TypeVar, cast

from PySide6.QtWidgets import QWidget

from ocmm_core.acceptance import ARTEFACT_KINDS, ArtefactEntry, typed_entry
from ocmm_core.composition import AcceptanceBench
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.export.certificate import artefact_fields, read_dcc, trusted_signers
from ocmm_core.failure import contained
from ocmm_core.seals import KeyFolder
from ocmm_gui import kit
from ocmm_gui.acceptance._start_page import kind_word, named_field
from ocmm_gui.kit import later, tr
from ocmm_gui.work import Teller, Worker, WorkSheet

_FIELDS = (
    ("id", later("Id"), later("What tests call it, such as BAR-1")),
    ("name", later("Name"), later("Of the artefact")),
    ("maker", later("Maker"), later("May be empty")),
    ("serial", later("Serial no."), later("As engraved")),
    ("laboratory", later("Laboratory"), later("That calibrated it")),
    ("certificate", later("Certificate no."), later("Of the laboratory")),
    ("due_utc", later("Due"), later("Holds until, like 2027-06-30: your own rule")),
    ("sizes", later("Sizes, mm"), later("At 20 °C: diameter; or nests of a bar from 0")),
    ("expanded", later("U, mm"), later("k = 2")),
    ("expanded_per_length", later("U per length"), later("Part that grows with length; or empty")),
    ("form", later("Form, mm"), later("Certified form error; empty if within U")),
    ("expansion", later("Expansion, 1/K"), later("Such as 1.15e-5")),
    ("expansion_sigma", later("its u, 1/K"), later("Standard uncertainty, such as 1e-6")),
    ("supports", later("Held"), later("Where and how it is held; may be empty")),
    ("quantity", later("Quantity"), later("Of a DCC with several lengths: part of its name")),
)  # fmt: skip
_CERTIFIED = ("serial", "laboratory", "certificate", "sizes", "expanded")
_NUMBERS = ("sizes", "expanded", "expanded_per_length", "form", "expansion", "expansion_sigma")
_IN_COLUMN = 8


class ArtefactForm(QWidget):
    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Artefact"))
        self.kind = kit.ChoiceBox(
            tr("Kind"), tr("What the artefact is"), [kind_word(one) for one in ARTEFACT_KINDS]
        )
        self.fields = {key: named_field(key, label, tip) for key, label, tip in _FIELDS}
        self._read: dict[str, str] = {}
        grid = kit.form_grid((self.kind, *self.fields.values()), down=_IN_COLUMN)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(4)
        self.setLayout(grid)

    def texts(self) -> dict[str, str]:
        """Return the field texts; changed certificate data counts as typed."""
        found = {key: field.text().strip() for key, field in self.fields.items()}
        found["kind"] = ARTEFACT_KINDS[self.kind.currentIndex()]
        read = {key: kit.localised(text) if key in _NUMBERS else text
                for key, text in self._read.items()}  # fmt: skip
        same = bool(read) and all(found[key] == read.get(key) for key in _CERTIFIED)
        found["source"] = self._read["source"] if same else "typed"
        found["certificate_sha256"] = self._read["certificate_sha256"] if same else ""
        return found

    def show_read(self, fields: Mapping[str, str]) -> None:
        """Fill in the data of a certificate."""
        self._read = dict(fields)
        for key, field in self.fields.items():
            if key in fields:
                field.setText(kit.localised(fields[key]) if key in _NUMBERS else fields[key])
        if "kind" in fields:
            self.kind.setCurrentIndex(ARTEFACT_KINDS.index(fields["kind"]))
        self.fields["id" if not self.fields["id"].text() else "due_utc"].setFocus()

    def show_entry(self, entry: ArtefactEntry) -> None:
        """Fill in a register entry, for a newer certificate."""
        self._read = {}
        for key, field in self.fields.items():
            value = getattr(entry, key, "")
            if key == "sizes":
                value = " ".join(repr(one) for one in entry.sizes)
            elif key == "due_utc":
                value = entry.due_utc[:10]
            text = value if isinstance(value, str) else repr(value)
            field.setText(kit.localised(text) if key in _NUMBERS else text)
        self.kind.setCurrentIndex(ARTEFACT_KINDS.index(entry.kind))

    def clear(self) -> None:
        self._read = {}
        for field in self.fields.values():
            field.clear()
        self.fields["id"].setFocus()


T = TypeVar("T")
_Register = tuple[tuple[ArtefactEntry, ...], dict[str, tuple[tuple[str, str], ...]]]
"""Entries, and for each the refusing procedures with reasons."""

_KEYS = (
    kit.ActionInfo("new", later("New"), later("Empty the fields"), ("F6",)),
    kit.ActionInfo("dcc", later("Read DCC"), later("Fill in from a digital certificate"), ("F7",)),
    kit.ActionInfo("store", later("Store"), later("Add to the register"), ("F8",)),
    kit.ActionInfo("edit", later("Renew"), later("Fill in the selected one, for a new certificate"),
               ("F10",)),
    kit.ActionInfo("remove", later("Remove"), later("Take the selected one out"), ("Ctrl+Del",)),
    kit.ActionInfo("stop", later("Stop"), later("Stop reading"), ("F9",)),
)  # fmt: skip
_COLUMNS = (
    (later("Id"), later("What tests call it")),
    (later("Kind"), later("What it is")),
    (later("Serial no."), later("As engraved")),
    (later("U, µm"), later("k = 2")),
    (later("Certificate"), later("Number and laboratory")),
    (later("Due"), later("Holds until")),
    (later("Refused for"), later("Procedures that cannot use it; select it for the reason")),
)


def _fields_of(
    path: Path, kind: Literal["bar", "sphere"], quantity: str, tell: Teller
) -> dict[str, str]:
    """Return the fields of a certificate; the process that reads it has no window."""
    tell(later("Reading the certificate"), 0.3)
    dcc = read_dcc(read_bytes(path), trusted_signers(KeyFolder()))
    return artefact_fields(dcc, kind, quantity=quantity)


class ArtefactSheet(WorkSheet):
    """A table above, the fields of a new or renewed artefact below."""

    def __init__(
        self,
        bench: AcceptanceBench,
        who: Callable[[], str],
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        super().__init__(tr("Artefacts"), _KEYS, tr("Reading the certificate"))
        self._bench, self._who, self._clock = bench, who, clock
        self._entries: tuple[ArtefactEntry, ...] = ()
        self._refused: dict[str, tuple[tuple[str, str], ...]] = {}
        # Reading verifies all hashes, and calibrations with their findings.
        self._register = Worker("ocmm-artefacts", self)
        self._asked = 0
        self._doing = 0
        self.table = kit.NumberTable(
            tr("Register of artefacts"), kit.tr_all(_COLUMNS), whole=False, font=kit.text_font(14)
        )
        self.table.setWordWrap(False)
        self.table.fit_columns(6)
        self.table.itemSelectionChanged.connect(self._show_reasons)
        self.reasons = kit.sentence_label(
            tr("Why the selected artefact is refused"), 14, role="warn"
        )
        self.form = ArtefactForm()
        self.file = kit.PathPanel(
            tr("Read the certificate from the file"), tr("File of the DCC"), tr("Read")
        )
        self.file.given.connect(self.read)
        self.sure = kit.AnswerPanel(tr("Remove the artefact"), tr("Remove"))
        self.sure.agreed.connect(self._remove)
        kit.fill(
            self.body, self.file, self.sure, self.working, (self.table, 1), self.reasons, self.form
        )
        self.use_keys(
            {
                "new": self.form.clear,
                "dcc": lambda: self.file.ask(Path.home() / "certificate.xml"),
                "store": self.store,
                "edit": self.edit,
                "remove": self.ask_to_remove,
                "stop": self.stop,
            },
            primary="store",
        )

    def open(self) -> None:
        self._read_register()
        self.table.setFocus()

    def close_work(self) -> None:
        super().close_work()
        self._register.close(0.0)

    def is_reading(self) -> bool:
        """Return whether the register is being read or written; for tests."""
        return self._doing > 0

    def read(self, path: Path) -> None:
        """Fill in the data of a certificate, without blocking."""
        texts = self.form.texts()
        if texts["kind"] not in ("bar", "sphere"):
            self.failed.emit(
                InputError(
                    "artefact.dcc", f"A DCC of a {texts['kind']} is not read.",
                    "Choose the kind 'bar' or 'sphere', or type the fields.",
                )
            )  # fmt: skip
            return
        kind = cast('Literal["bar", "sphere"]', texts["kind"])
        self._start(
            tr("Reading the certificate"), partial(_fields_of, path, kind, texts["quantity"])
        )

    def store(self) -> None:
        """Add the entry; an existing id gets the newer certificate."""
        entry = self.attempt(
            lambda: typed_entry(self.form.texts(), comma=kit.numbers_in_use().comma)
        )
        if entry is None:
            return
        who, now = self._who(), self._clock()

        def add() -> None:
            register = self._bench.artefacts()
            known = register.entries.get(entry.id)
            if known is not None and known.certificate == entry.certificate:
                raise InputError(
                    "artefact.taken", f"'{entry.id}' with certificate {entry.certificate} is there "
                    "already.", "Give its new certificate, or another id.",
                )  # fmt: skip
            register.add(entry, who, now, replace=known is not None)

        def done(_none: None) -> None:
            self.told.emit(
                tr("Stored: {id}, due {due}.").format(id=entry.id, due=kit.day_words(entry.due_utc))
            )
            # Text typed meanwhile belongs to another artefact.
            if self.form.texts()["id"].strip() == entry.id:
                self.form.clear()
            self.open()

        self._do(add, done, "The artefact register")

    def edit(self) -> None:
        entry = self._selected()
        if entry is not None:
            self.form.show_entry(entry)
            self.form.fields["certificate"].setFocus()

    def ask_to_remove(self) -> None:
        entry = self._selected()
        if entry is not None:
            self.sure.ask(tr("Remove {id} from the register?").format(id=entry.id))

    def _do(self, call: Callable[[], T], done: Callable[[T], None], reading: str) -> None:
        self._doing += 1

        def finish(answer: T) -> None:
            self._doing -= 1
            done(answer)

        def fail(error: Exception) -> None:
            self._doing -= 1
            self.show_message(tr("Failed; the previous result is still shown."))
            self.failed.emit(contained(error, reading, "Nothing was changed."))

        self._register.do(call, finish, fail)

    def _read_register(self) -> None:
        now = self._clock()
        self._asked += 1
        asked = self._asked
        self.show_message(tr("Reading the register"))

        def read() -> _Register:
            entries = tuple(self._bench.artefacts().entries.values())
            return entries, {one.id: self._bench.refused_for(one, now) for one in entries}

        def done(found: _Register) -> None:
            # Requested again meanwhile: a later answer follows.
            if asked == self._asked:
                self._entries, self._refused = found
                self._show_register()

        self._do(read, done, "The artefact register")

    def _show_register(self) -> None:
        self.table.setRowCount(len(self._entries))
        for row, one in enumerate(self._entries):
            refused = [name for name, why in self._refused[one.id] if why]
            asked = self._refused[one.id]
            words = ", ".join(refused) if refused else tr("nothing") if asked else tr("no test")
            self.table.show_words(
                row,
                (
                    one.id, kind_word(one.kind), one.serial,
                    kit.localised(f"{1e3 * one.expanded:.2f}"),
                    f"{one.certificate}, {one.laboratory}", kit.day_words(one.due_utc),
                    f"▲ {words}" if refused else words,
                ),
            )  # fmt: skip
        count = tr("%n artefacts", "1 artefact", len(self._entries))
        self.show_message(
            tr("{count} in the register. Nothing is overwritten.").format(count=count)
        )
        if self._entries:
            self.table.selectRow(0)
        self._show_reasons()

    def _selected(self) -> ArtefactEntry | None:
        row = self.table.currentRow()
        return self._entries[row] if 0 <= row < len(self._entries) else None

    def _show_reasons(self) -> None:
        entry = self._selected()
        said = () if entry is None else self._refused[entry.id]
        self.reasons.setText("\n".join(dict.fromkeys(f"▲ {why}" for _, why in said if why)))

    def _remove(self) -> None:
        entry = self._selected()
        if entry is None:
            return

        who, now = self._who(), self._clock()

        def done(_none: None) -> None:
            self.told.emit(tr("Removed: {id}. Its lines stay in the file.").format(id=entry.id))
            self.open()

        def remove() -> None:
            self._bench.artefacts().remove(entry.id, who, now)

        self._do(remove, done, "The artefact register")

    def _show(self, answer: object) -> None:
        if isinstance(answer, dict):
            self.form.show_read(answer)
            self.show_message(tr("Read. Give an id and a due date, then store (F8)."))
