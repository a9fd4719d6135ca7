"""Preconditions of a test: artefacts, instrument, and earlier use of both."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import msgspec

from ocmm_core.acceptance._kinds import kind_of
from ocmm_core.acceptance._procedure import BallTest, DiameterTest, LocationTest, SphereTest
from ocmm_core.acceptance._result import ClimateReading, UsedArtefact
from ocmm_core.acceptance._situation import Stage
from ocmm_core.calibration.guided import Spots
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Artefact, ArtefactUse, Finding, same_serial
from ocmm_core.documents import files_of_folder, read_bytes
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float

_FORM_SHARE = 0.20
"""Certified form of a sphere over the limit of form (ISO 10360-5)."""

_READY = ("VALID", "DUE", "DESIGN")
"""`DESIGN` is a virtual rig: real cameras have a record, or record no points."""

_LARGEST_MM = 1e5


@dataclass(frozen=True, slots=True)
class EarlierUse:
    """Artefacts and observations behind the instrument, which may not test it."""

    calibration: tuple[ArtefactUse, ...] = ()
    qualification: tuple[ArtefactUse, ...] = ()
    spots: tuple[str, ...] = ()
    """`spots_hash` of observations."""


def begin_findings(
    stage: Stage, now: datetime, temperature: Temperature, earlier: EarlierUse
) -> list[Finding]:
    """Return objections; artefacts of calibration and tip qualification may not test themselves."""
    found = [*_instrument(stage, temperature.celsius)]
    for artefact in stage.artefacts:
        found += artefact_findings(stage, artefact, now, temperature, earlier)
    return list(dict.fromkeys(found))


def artefact_findings(
    stage: Stage,
    artefact: UsedArtefact,
    now: datetime,
    temperature: Temperature,
    earlier: EarlierUse,
) -> list[Finding]:
    """Return objections to a needed artefact; parameters as in `begin_findings`."""
    if artefact.role not in kind_of(stage).roles:
        return []
    known = msgspec.convert(artefact, Artefact, from_attributes=True)
    found: list[Finding] = []
    for length, limit in _certified_limits(stage, artefact):
        found += known.judge(length, limit, now, temperature)
    found += _reused(artefact, earlier.calibration, "calibrated", "acceptance.calibration")
    found += _reused(artefact, earlier.qualification, "qualified", "acceptance.qualification")
    found += _sphere(stage, artefact)
    return list(dict.fromkeys(found))


def _instrument(stage: Stage, celsius: float) -> Iterator[Finding]:
    climate = stage.procedure.climate
    status = stage.instrument.calibration_status or "unknown"
    if stage.instrument.calibration_status not in _READY:
        yield Finding(
            "acceptance.calibration_status",
            f"The calibration of '{stage.instrument.rig}' is {status}.",
            "Calibrate and verify the cameras before an acceptance test.",
            refuses=True,
        )
    lacking = stage.instrument.age_doubts or ()
    if lacking and stage.procedure.cameras != "unproven":
        yield Finding(
            "acceptance.unproven",
            f"The cameras cannot prove how old their data are or in which order they came "
            f"({'; '.join(lacking)}), and '{stage.procedure.id}' does not allow such cameras.",
            "Test with cameras that send a counter and the time of exposure. Whether others "
            "are accepted is agreed beforehand: field 'cameras' of a procedure of your own.",
            refuses=True,
        )
    if not climate.low <= celsius <= climate.high:
        yield Finding(
            "acceptance.climate",
            f"It is {celsius:g} °C; '{stage.procedure.id}' is rated for "
            f"{climate.low:g} to {climate.high:g} °C.",
            "Wait until the room is within that range.",
            refuses=True,
        )


def _certified_limits(stage: Stage, artefact: UsedArtefact) -> list[tuple[float, float]]:
    """Return the lengths of an artefact with the limits that they test."""
    limits = stage.procedure.limits
    if artefact.role == "bar":
        limit = limits.get("E") or limits.get("E_L") or limits.get("V_max")
        lengths = [one - artefact.sizes[0] for one in artefact.sizes[1:]]
        return [(one, limit.at(one)) for one in lengths] if limit else []
    if artefact.role == "gauge block":
        limit = limits.get("E")
        return [(artefact.sizes[0], limit.at(artefact.sizes[0]))] if limit else []
    if artefact.role == "dumbbell":
        return [(artefact.sizes[2], stage.limit("Interim_L").at(artefact.sizes[2]))]
    names = ("P_Size", "D_eff", "Thickness")
    return [
        (artefact.sizes[0], limits[one].at(artefact.sizes[0])) for one in names if one in limits
    ]


def _reused(
    artefact: UsedArtefact, before: Sequence[ArtefactUse], how: str, code: str
) -> list[Finding]:
    use = artefact.use
    for one in before:
        same_file = bool(use.certificate_sha256) and (
            use.certificate_sha256 == one.certificate_sha256
        )
        if same_serial(use.serial, one.serial) or same_file:
            return [
                Finding(
                    code,
                    f"The instrument was {how} with the same '{use.name}' (serial {use.serial}): "
                    "an error of its certificate would go unnoticed.",
                    "Test with another certified artefact.",
                    refuses=True,
                )
            ]
    return []


def _sphere(stage: Stage, artefact: UsedArtefact) -> Iterator[Finding]:
    numbers = stage.procedure.test
    if artefact.role != "sphere":
        return
    if isinstance(numbers, SphereTest | LocationTest | DiameterTest | BallTest):
        low, high = numbers.diameter
        if not low <= artefact.sizes[0] <= high:
            yield Finding(
                "acceptance.sphere_size",
                f"'{artefact.use.name}' has {artefact.sizes[0]:g} mm; {low:g} to {high:g} mm "
                "are allowed.",
                "Use another sphere.",
                refuses=True,
            )
    limit = stage.procedure.limits.get("P_Form")
    if limit is not None and artefact.form > _FORM_SHARE * limit.constant:
        yield Finding(
            "acceptance.sphere_form",
            f"'{artefact.use.name}' has a form error of {1e3 * artefact.form:.1f} µm; "
            f"{1e3 * _FORM_SHARE * limit.constant:.1f} µm are allowed.",
            "Use a better sphere.",
            refuses=True,
        )


def spots_hash(uv: Spots) -> str:
    """Return the identity of averaged spots."""
    return hashlib.sha256(msgspec.json.encode(uv)).hexdigest()


def require_usable(tip: Float) -> None:
    """Raise InputError for an impossible ball centre (3,), mm."""
    if tip.shape != (3,) or not bool((abs(tip) < _LARGEST_MM).all()):
        raise InputError(
            "acceptance.point",
            "A ball centre is not finite, or kilometres away.",
            "Take the point again.",
        )


def climate_reasons(stage: Stage, climate: Sequence[ClimateReading]) -> list[str]:
    """Return why the temperatures make a test void; empty if they do not.

    A change is too large if two temperatures differ by more than is allowed in the time between
    them; intervals below an hour count as an hour, because thermometers jitter.
    """
    rule, reasons = stage.procedure.climate, []
    for one in climate:
        if not rule.low <= one.celsius <= rule.high:
            reasons.append(
                f"{one.celsius:g} °C at '{one.position}'; rated are {rule.low:g} to "
                f"{rule.high:g} °C."
            )
            break
    times = [datetime.fromisoformat(one.utc) for one in climate]
    worst = 0.0
    for i in range(len(climate)):
        for j in range(i):
            hours = max(abs((times[i] - times[j]).total_seconds()) / 3600.0, 1.0)
            worst = max(worst, abs(climate[i].celsius - climate[j].celsius) / hours)
    if worst > rule.per_hour:
        reasons.append(
            f"The temperature changed by {worst:.1f} K within an hour; {rule.per_hour:g} K are "
            "allowed."
        )
    return reasons


def reserved_spots(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return `spots_hash` of all readable observations in the session files of folders."""
    found: dict[str, None] = {}
    for folder in folders:
        for path in files_of_folder(folder, ""):
            for line in read_bytes(path).splitlines() if path.is_file() else []:
                try:
                    _collect(msgspec.json.decode(line), found)
                except (msgspec.DecodeError, RecursionError, UnicodeError):
                    continue
    return tuple(found)


def _collect(value: object, found: dict[str, None]) -> None:
    if isinstance(value, dict):
        if isinstance(value.get("uv"), list):
            found[hashlib.sha256(msgspec.json.encode(value["uv"])).hexdigest()] = None
        for one in value.values():
            _collect(one, found)
    elif isinstance(value, list):
        for one in value:
            if isinstance(one, dict):
                _collect(one, found)
