"""View of the window with all wizards: start or resume, then run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from ocmm_core.calibration.guided import (
    Procedure,
    ProcedureDecision,
    ProcedureKind,
    SessionSite,
    sessions,
)
from ocmm_core.calibration.records import practice_name, require_real_name
from ocmm_core.errors import OcmmError
from ocmm_core.tables import TableOptions, preview_table
from ocmm_gui.kit import TableImport, Theme, said, said_word, time_words, tr
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._registry import WIZARDS, WizardSpec, wizard_of
from ocmm_gui.wizards._runner import GuidedStack, Runner
from ocmm_gui.wizards._site import (
    SESSIONS,
    OpenSession,
    UnfinishedSession,
    WizardSite,
    named,
    require_store,
    session_site,
    store_of,
    table_values,
    temperature,
)
from ocmm_gui.wizards._wizard_parts import WizardStart
from ocmm_gui.wizards.pages import WHO, Field

_PAST = ("session.rig", "session.empty")
"""Sessions not offered: of a replaced calibration, or empty."""


def fields(site: WizardSite, spec: WizardSpec[Any]) -> tuple[Field, ...]:
    return tuple(
        Field(one.key, one.label, one.tip, site.who) if one is WHO else one
        for one in spec.fields(site)
    )


def start_session(
    site: WizardSite, spec: WizardSpec[Any], values: Mapping[str, str], now: datetime
) -> OpenSession:
    """Start a session with filled-in fields; raise OcmmError if impossible."""
    place = session_site(site, spec.subject)
    sign = require_real_name if site.practice is None else practice_name
    signed = {**values, "who": sign(values["who"])}
    return _opened(spec, place, spec.procedure.start(place, spec.setup(signed, now), now))


def resume(site: WizardSite, spec: WizardSpec[Any], path: Path) -> OpenSession:
    """Resume a session; raise OcmmError if impossible."""
    place = session_site(site, spec.subject)
    return _opened(spec, place, spec.procedure.resume(place, path))


def offers(site: WizardSite, spec: WizardSpec[Any]) -> tuple[UnfinishedSession, ...]:
    """Return the unfinished sessions of a wizard, newest first."""
    store = store_of(site, spec.subject)
    if store is None:
        return ()
    found = []
    try:
        paths = sessions(store / SESSIONS, spec.kind)
    except OcmmError as error:
        return (
            UnfinishedSession(store / SESSIONS, SESSIONS, said(f"{error.what} {error.remedy}")),
        )
    for path in paths:
        try:
            base = resume(site, spec, path).procedure.base
        except OcmmError as error:
            if error.code not in _PAST:
                found.append(
                    UnfinishedSession(path, path.name, said(f"{error.what} {error.remedy}"))
                )
            continue
        # Accepted but not in the store: interrupted just before storing.
        if not (base.stored or base.decision is ProcedureDecision.KEPT):
            begun = datetime.fromisoformat(base.begun_utc).astimezone()
            step = base.step
            where = said_word(step.title).lower()
            if step.wanted:
                count = tr("{done} of {wanted}").format(done=step.done, wanted=step.wanted)
                where = f"{where}, {count}"
            found.append(UnfinishedSession(path, f"{time_words(begun)}, {base.who}: {where}"))
    return tuple(found)


def _opened(spec: WizardSpec[Any], site: SessionSite, procedure: Procedure) -> OpenSession:
    predict = None if spec.predict is None else partial(spec.predict, procedure)
    session = procedure.base.session
    again = partial(spec.procedure.resume, site, session) if spec.is_slow else None
    return OpenSession(procedure, site, again, predict)


class Wizard(GuidedStack):
    """One wizard at a time."""

    def __init__(
        self, site: WizardSite, clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        super().__init__()
        self.setAccessibleName(tr("Wizard"))
        self._site = site
        self._clock = clock
        self._spec = WIZARDS[0]
        self.start = WizardStart()
        self.addWidget(self.start)
        self.start.begun.connect(self._start)
        self.start.resumed.connect(self._resume)
        self.start.left.connect(self.leave)
        self._asked: tuple[Field, ...] = ()
        self._values: dict[str, str] = {}
        self._reads: Field | None = None
        self.tables = TableImport("name,x,y,z,-")
        self.tables.changed.connect(self._read_table)
        self.tables.taken.connect(self._take_table)
        self.tables.declined.connect(self._decline_table)
        self.tables.setContentsMargins(18, 12, 18, 12)
        self.addWidget(self.tables)

    def topic(self) -> str:
        return self._spec.kind.value

    def open(self, kind: ProcedureKind) -> None:
        """Show the start page of a wizard with unfinished sessions."""
        self.close_runner()
        self._spec = spec = wizard_of(kind)
        trouble = ""
        asked: tuple[Field, ...] = ()
        offered: tuple[UnfinishedSession, ...] = ()
        try:
            if self._site.practice is not None:
                self._site.practice.prepare(self._clock())
            asked, offered = fields(self._site, spec), offers(self._site, spec)
            require_store(self._site, spec.subject)
        except OcmmError as error:
            trouble = said(f"{error.what} {error.remedy}")
        self.start.ask(
            spec.texts.title, spec.texts.purpose, asked, offered,
            practice=self._site.practice is not None,
        )  # fmt: skip
        self._asked = asked
        self.setCurrentWidget(self.start)
        self.start.show_trouble(trouble)

    def set_theme(self, theme: Theme) -> None:
        super().set_theme(theme)
        self.tables.set_theme(theme)

    def _start(self, values: dict[str, str]) -> None:
        """Start a session, after the tables that it reads were shown and accepted."""
        try:
            named(values)
            if values.get("temperature", "").strip():
                temperature(values, self._clock())
        except OcmmError as error:
            self._refuse(error)
            return
        self._values = values
        self._reads = next((one for one in self._asked if _is_to_be_shown(one, values)), None)
        if self._reads is None:
            self._run(lambda: start_session(self._site, self._spec, values, self._clock()))
            return
        path = Path(values[self._reads.key].strip()).expanduser()
        self.tables.open_table(path)
        self._read_table(path, TableOptions())

    def _read_table(self, path: Path, options: TableOptions) -> None:
        if self._reads is None or self._reads.table is None:
            return
        try:
            found = preview_table(path, options, self._reads.table)
        except OcmmError as error:
            self._refuse(error)
            return
        self.tables.show_preview(found)
        self.setCurrentWidget(self.tables)

    def _take_table(self, _table: object) -> None:
        if self._reads is not None:
            stated = table_values(self._reads.key, self.tables.options())
            self.setCurrentWidget(self.start)
            self._start({**self._values, **stated})

    def _refuse(self, error: OcmmError) -> None:
        self._decline_table()
        self.start.show_trouble(said(f"{error.what} {error.remedy}"))

    def _decline_table(self) -> None:
        self._reads = None
        self.setCurrentWidget(self.start)

    def _resume(self, path: Path) -> None:
        def opened() -> OpenSession:
            warm = temperature(self.start.values(), self._clock())
            found = resume(self._site, self._spec, path)
            if warm is not None:
                found.procedure.note_temperature(self._clock(), warm)
            return found

        self._run(opened)

    def _run(self, make: Callable[[], OpenSession]) -> None:
        try:
            opened = make()
        except OcmmError as error:
            self._refuse(error)
            return
        driver = WizardDriver(
            opened.procedure, self._site.tap_for(opened.procedure, self.failed.emit),
            opened.again, opened.predict,
            self._site.temperature_state, self._clock,
        )  # fmt: skip
        spec = self._spec
        pages = spec.pages(opened.site, opened.procedure)
        runner = Runner(
            driver, spec.texts, pages, _commands(spec, opened, driver),
            practice=self._site.practice is not None,
        )  # fmt: skip
        self._show_runner(runner, driver, opened.procedure.base.torn)


def _is_to_be_shown(field: Field, values: Mapping[str, str]) -> bool:
    """Return whether a field names a table that the user has not seen yet."""
    key, value = field.only_with
    is_needed = field.table is not None and values.get(key, "") == value
    return is_needed and bool(values[field.key].strip()) and f"{field.key}.unit" not in values


def _commands(
    spec: WizardSpec[Any], opened: OpenSession, driver: WizardDriver
) -> dict[str, Callable[[], None]]:
    """Return the commands specific to a procedure, by action key."""

    def call(key: str) -> None:
        driver.do(spec.commands[key](opened.procedure))

    return {key: partial(call, key) for key in spec.commands}
