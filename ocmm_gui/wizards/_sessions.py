"""Sessions of all wizards: what is asked before they begin, how they begin and how they go on."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from ocmm_core.calibration.guided import ProcedureDecision, sessions
from ocmm_core.calibration.records import practice_name, require_real_name
from ocmm_core.errors import OcmmError
from ocmm_gui.kit import said, said_word, time_words, tr
from ocmm_gui.wizards._registry import WizardSpec
from ocmm_gui.wizards._site import (
    SESSIONS,
    DirectCalculation,
    Offer,
    Opened,
    SessionPlace,
    WizardSite,
    place_of,
    store_of,
)
from ocmm_gui.wizards.parts import WHO, Field, ProcessCalculation, ShownProcedure

_PAST = ("session.rig", "session.empty")
"""Codes of sessions that nobody misses: of a calibration that is no longer in force, or without
anything in them."""


def fields(site: WizardSite, spec: WizardSpec[Any]) -> tuple[Field, ...]:
    """Return what is filled in before a session begins."""
    return tuple(
        Field(one.key, one.label, one.tip, site.who) if one is WHO else one
        for one in spec.fields(site)
    )


def begin(
    site: WizardSite, spec: WizardSpec[Any], values: Mapping[str, str], now: datetime
) -> Opened:
    """Begin a session with what was filled in.

    Raises
    ------
    OcmmError
        A document cannot be used, something is missing, or the session cannot be stored.
    """
    place = place_of(site, spec.subject)
    sign = require_real_name if site.practice is None else practice_name
    signed = {**values, "who": sign(values["who"])}
    return _opened(spec, place, spec.begin(place, signed, now))


def resume(site: WizardSite, spec: WizardSpec[Any], path: Path) -> Opened:
    """Go on with a session; raise OcmmError where that is not possible."""
    place = place_of(site, spec.subject)
    return _opened(spec, place, spec.resume(place, path))


def offers(site: WizardSite, spec: WizardSpec[Any]) -> tuple[Offer, ...]:
    """Return the sessions of a wizard that were not ended, the newest first."""
    store = store_of(site, spec.subject)
    if store is None:
        return ()
    found = []
    for path in sessions(store / SESSIONS, spec.kind):
        try:
            base = resume(site, spec, path).procedure.base
        except OcmmError as error:
            if error.code not in _PAST:
                found.append(Offer(path, path.name, said(f"{error.what} {error.remedy}")))
            continue
        # What was accepted, but is not in the store, was interrupted just before it got there.
        if not (base.stored or base.decision is ProcedureDecision.KEPT):
            begun = datetime.fromisoformat(base.begun_utc).astimezone()
            step = base.step
            where = said_word(step.title).lower()
            if step.wanted:
                count = tr("{done} of {wanted}").format(done=step.done, wanted=step.wanted)
                where = f"{where}, {count}"
            found.append(Offer(path, f"{time_words(begun)}, {base.who}: {where}"))
    return tuple(found)


def _opened(spec: WizardSpec[Any], place: SessionPlace, procedure: ShownProcedure) -> Opened:
    """Return a procedure with what calculates its result."""
    predict = None if spec.predict is None else partial(spec.predict, procedure)
    if not spec.is_slow:
        return Opened(procedure, place, DirectCalculation(procedure), predict)
    again = partial(spec.resume, place, procedure.base.session)
    return Opened(procedure, place, ProcessCalculation(procedure, again), predict)
