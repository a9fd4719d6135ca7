"""Sessions of all wizards: what is asked before they begin, how they begin and how they go on."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from ocmm_core.calibration.guided import Decision, Kind, sessions
from ocmm_core.errors import OcmmError
from ocmm_gui.wizards._camera_sessions import (
    begin_camera_session,
    opened_camera_session,
    resumed_camera_session,
)
from ocmm_gui.wizards._probe_sessions import (
    PROBE_KINDS,
    begin_probe_session,
    opened_probe_session,
    probe_fields,
    resumed_probe_session,
)
from ocmm_gui.wizards._site import (
    SESSIONS,
    Offer,
    Opened,
    WizardSite,
    probe_site_of,
    running_rig,
    store_folder_of,
)
from ocmm_gui.wizards.parts import FIELDS, WHO, Field

_PAST = ("session.rig", "session.empty")
"""Codes of sessions that nobody misses: of a calibration that is no longer in force, or without
anything in them."""


def fields(site: WizardSite, kind: Kind) -> tuple[Field, ...]:
    """Return what is filled in before a session of a kind begins."""
    asked = FIELDS[kind] if kind in FIELDS else probe_fields(site, kind)
    return tuple(
        Field(one.key, one.label, one.tip, site.who) if one is WHO else one for one in asked
    )


def begin(site: WizardSite, kind: Kind, values: Mapping[str, str], now: datetime) -> Opened:
    """Begin a session with what was filled in.

    Raises
    ------
    OcmmError
        A document cannot be used, something is missing, or the session cannot be stored.
    """
    if kind in PROBE_KINDS:
        return begin_probe_session(site, kind, values, now)
    return begin_camera_session(site, kind, values, now)


def resume(site: WizardSite, kind: Kind, path: Path) -> Opened:
    """Go on with a session; raise OcmmError where that is not possible."""
    if kind in PROBE_KINDS:
        return opened_probe_session(site, kind, resumed_probe_session(site, kind, path))
    rig, folder = running_rig(site), store_folder_of(site)
    again = resumed_camera_session(kind, path, rig, site.body, folder)
    return opened_camera_session(site, kind, rig, again)


def require_store(site: WizardSite, kind: Kind) -> None:
    """Raise CalibrationError where there is no place to keep what a wizard finds."""
    if kind in PROBE_KINDS:
        probe_site_of(site)
    else:
        store_folder_of(site)


def offers(site: WizardSite, kind: Kind) -> tuple[Offer, ...]:
    """Return the sessions of a kind that were not ended, the newest first."""
    store = _store_of(site, kind)
    if store is None:
        return ()
    found = []
    for path in sessions(store / SESSIONS, kind):
        try:
            base = resume(site, kind, path).procedure.base
        except OcmmError as error:
            if error.code not in _PAST:
                found.append(Offer(path, path.name, f"{error.what} {error.remedy}"))
            continue
        # What was accepted, but is not in the store, was interrupted just before it got there.
        if not (base.stored or base.decision is Decision.KEPT):
            begun = datetime.fromisoformat(base.begun_utc).astimezone()
            step = base.step
            count = f", {step.done} of {step.wanted}" if step.wanted else ""
            found.append(
                Offer(path, f"{begun:%Y-%m-%d %H:%M}, {base.who}: {step.title.lower()}{count}")
            )
    return tuple(found)


def _store_of(site: WizardSite, kind: Kind) -> Path | None:
    if kind in PROBE_KINDS:
        return None if site.probe is None else site.probe.store
    return site.store
