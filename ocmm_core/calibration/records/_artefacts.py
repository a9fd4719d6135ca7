"""Calibrated artefacts: length bars and spheres, with their certificates.

User documents. An artefact is refused if its certificate has expired or does not cover the
temperature or length; also if its uncertainty exceeds a third of the permissible error (above a
fifth: warning). Such findings have remedies, and some of them may be overruled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import msgspec

from ocmm_core.calibration.probe_design import (
    HIGHEST_C,
    LOWEST_C,
    Temperature,
    certified_at,
    require_temperature,
)
from ocmm_core.calibration.records._records import ArtefactUse
from ocmm_core.documents import Document, load_with_text, text_digest
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.typed_numbers import EXPANDED, EXPANSION, EXPANSION_SIGMA, PER_LENGTH, SIZE


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding against a calibration."""

    code: str
    what: str
    remedy: str
    """`code`, `what`, `remedy`: As in `OcmmError`."""
    refuses: bool
    forcible: bool = False
    """The user may overrule it."""


def let_pass(findings: Sequence[Finding], force: bool) -> tuple[Finding, ...]:
    """Return the warnings; with ``force`` also the overruled refusals.

    CalibrationError if a finding refuses, first of all one that cannot be forced.
    """
    hard = [one for one in findings if one.refuses and not (one.forcible and force)]
    hard.sort(key=lambda one: one.forcible)
    if hard:
        remedy = hard[0].remedy
        if hard[0].forcible:
            remedy += " If you know why this is right, you can override it with a reason."
        raise CalibrationError(hard[0].code, hard[0].what, remedy)
    return tuple(replace(one, refuses=False) for one in findings)


def same_serial(one: str, other: str) -> bool:
    """Return whether two serial numbers agree, ignoring case, blanks and punctuation.

    Text without a letter or digit is no serial number and equals no other.
    """
    bare = _bare(one)
    return bool(bare) and bare == _bare(other)


def rests_on(artefacts: Sequence[ArtefactUse], serial: str) -> bool:
    """Return whether a result rests on an artefact with this serial number."""
    return any(same_serial(one.serial, serial) for one in artefacts)


def _bare(serial: str) -> str:
    return "".join(letter for letter in serial.casefold() if letter.isalnum())


BAR_SCHEMA = "ocmm.length-bar/1"
SPHERE_SCHEMA = "ocmm.sphere/1"
RATED_C = (10.0, 35.0)
"""Default temperature range: a workshop. Further from 20 degrees the certified expansion does not
hold, and mounting and nests differ from their state at calibration."""

U_WARNED, U_REFUSED = 1.0 / 5.0, 1.0 / 3.0
"""Expanded uncertainty of an artefact over the permissible error."""


class ArtefactCertificate(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    number: str
    sha256: str
    """SHA-256 of its file; empty without a file."""
    due_utc: str
    """ISO 8601 text: it holds until then."""


class ArtefactHead(Document, frozen=True, kw_only=True):
    """Head of every artefact, also of one without a certificate."""

    name: str
    serial: str
    expanded: float
    expanded_per_length: float = 0.0
    """`expanded`, `expanded_per_length`: Expanded uncertainty (k = 2) of a certified length:
    constant part, mm, and part of the length."""
    expansion: float
    expansion_sigma: float
    """`expansion`, `expansion_sigma`: Thermal expansion and its standard uncertainty, 1/K."""
    temperatures: tuple[float, float] = RATED_C
    """Temperature range in which the certificate and expansion hold, degrees Celsius."""


class ArtefactDocument(ArtefactHead, frozen=True, kw_only=True):
    """Head of an artefact with a certificate."""

    certificate: ArtefactCertificate
    certified: tuple[float, float] | None = None
    """From and to, mm: certified lengths; without it, all that the document names."""


class BarDocument(ArtefactDocument, frozen=True, kw_only=True):
    """A length bar."""

    nests: tuple[float, ...]
    """Places of the nests for the ball along the bar at 20 degrees, mm; the first is zero."""
    leds: tuple[float, ...] = ()
    """LED positions at its ends along the bar; empty without LEDs."""


class SphereDocument(ArtefactDocument, frozen=True, kw_only=True):
    diameter: float
    """At 20 degrees, mm."""


@dataclass(frozen=True, slots=True)
class Artefact:
    """Common part of bars and spheres; see `ArtefactDocument`."""

    use: ArtefactUse
    expanded: float
    expanded_per_length: float
    expansion: float
    expansion_sigma: float
    identity: str
    temperatures: tuple[float, float] = RATED_C

    def at(self, length: float, temperature: Temperature | None) -> tuple[float, float]:
        """Return a certified length and its expanded uncertainty (k = 2), mm, at a temperature.

        See `probe_design.certified_at`; InputError for a temperature outside the certificate.
        """
        outside = self._outside(temperature)
        if outside is not None:
            raise InputError(outside.code, outside.what, outside.remedy)
        expanded = self.expanded + self.expanded_per_length * abs(length)
        return certified_at(length, expanded, self.expansion, self.expansion_sigma, temperature)

    def judge(
        self, length: float, limit: float, now: datetime, temperature: Temperature | None
    ) -> list[Finding]:
        """Return findings on use for a length, limit (mm), ambient; InputError if implausible."""
        outside = self._outside(temperature)
        found = [] if outside is None else [outside]
        due = datetime.fromisoformat(self.use.due_utc)
        if now >= due:
            found.append(
                Finding(
                    "artefact.expired",
                    f"The certificate of '{self.use.name}' (serial {self.use.serial}) expired "
                    f"on {due.date().isoformat()}.",
                    "Have it calibrated, or use another one.",
                    refuses=True,
                )
            )
        expanded = self.expanded + self.expanded_per_length * length
        if expanded > U_WARNED * limit:
            found.append(
                Finding(
                    "artefact.uncertainty",
                    f"'{self.use.name}' (serial {self.use.serial}) is certified to "
                    f"{1e3 * expanded:.1f} um; the limit is {1e3 * limit:.1f} um.",
                    "Use an artefact certified to a fifth of the limit.",
                    refuses=expanded > U_REFUSED * limit,
                )
            )
        return found

    def _outside(self, temperature: Temperature | None) -> Finding | None:
        if temperature is None:
            return None
        celsius = temperature.celsius
        require_temperature("surroundings", celsius)
        low, high = self.temperatures
        if low <= celsius <= high:
            return None
        return Finding(
            "artefact.temperature",
            f"The certificate of '{self.use.name}' (serial {self.use.serial}) covers {low:g} to "
            f"{high:g} °C, but the ambient temperature is given as {celsius:g} °C.",
            "Correct the temperature, wait until the room is within that range, or use an "
            "artefact certified for it.",
            refuses=True,
        )


@dataclass(frozen=True, slots=True)
class LengthBar:
    artefact: Artefact
    nests: tuple[float, ...]
    leds: tuple[float, ...]
    """`nests`, `leds`: mm along the bar at 20 degrees."""


@dataclass(frozen=True, slots=True)
class Sphere:
    artefact: Artefact
    diameter: float
    """mm at 20 degrees."""


def load_bar(path: Path | str) -> LengthBar:
    """Return a length bar; InputError if malformed, places not ascending, or not two LEDs."""
    document, text = load_with_text(path, BarDocument, BAR_SCHEMA)
    for field, places in (("nests", document.nests), ("leds", document.leds)):
        if any(after <= before for before, after in pairwise(places)):
            raise _wrong(
                path, field, "is not in ascending order", "List the positions from one end."
            )
    if len(document.nests) < 2:
        raise _wrong(path, "nests", "has fewer than two places", "Name all nests.")
    if len(document.leds) not in (0, 2):
        raise _wrong(path, "leds", f"has {len(document.leds)} places", "Give two, or none.")
    for field, places in (("nests", document.nests), ("leds", document.leds)):
        for place in places[1:]:
            _require_certified(path, document, field, place - places[0])
    return LengthBar(
        artefact_of(path, document, document.certificate, text), document.nests, document.leds
    )


def load_sphere(path: Path | str) -> Sphere:
    """Return the sphere of a document; raise InputError if malformed."""
    document, text = load_with_text(path, SphereDocument, SPHERE_SCHEMA)
    if not 0.0 < document.diameter <= SIZE.quantity.most:
        raise _wrong(path, "diameter", f"is {document.diameter:g}", "Give it in millimetres.")
    _require_certified(path, document, "diameter", document.diameter)
    return Sphere(artefact_of(path, document, document.certificate, text), document.diameter)


_TYPED = {
    "expanded": EXPANDED, "expanded_per_length": PER_LENGTH, "expansion": EXPANSION,
    "expansion_sigma": EXPANSION_SIGMA,
}  # fmt: skip


NO_CERTIFICATE = ArtefactCertificate(number="", sha256="", due_utc="9999-12-31T00:00:00+00:00")


def artefact_of(
    path: Path | str, document: ArtefactHead, certificate: ArtefactCertificate | None, text: str
) -> Artefact:
    """Return the artefact of a document and its text; InputError for numbers out of range."""
    certificate = certificate or NO_CERTIFICATE
    for field, number in _TYPED.items():
        value, one = getattr(document, field), number.quantity
        if value not in one:
            raise _wrong(
                path, field, f"is {value:g}",
                f"Give a number from {one.least:g} to {one.most:g}, in mm or 1/K.",
            )  # fmt: skip
    low, high = document.temperatures
    if not LOWEST_C <= low < high <= HIGHEST_C:
        raise _wrong(
            path,
            "temperatures",
            f"is from {low:g} to {high:g} °C",
            f"Give the range of the certificate, within {LOWEST_C:g} to {HIGHEST_C:g} °C.",
        )
    try:
        due = datetime.fromisoformat(certificate.due_utc)
    except ValueError as error:
        raise _wrong(
            path, "certificate.due_utc", "is not a date", "Write it like 2030-12-31T00:00:00+00:00."
        ) from error
    if due.tzinfo is None:
        due = due.replace(tzinfo=UTC)
    return Artefact(
        use=ArtefactUse(
            name=document.name,
            serial=document.serial,
            certificate=certificate.number,
            certificate_sha256=certificate.sha256,
            due_utc=due.isoformat(),
        ),
        expanded=document.expanded,
        expanded_per_length=document.expanded_per_length,
        expansion=document.expansion,
        expansion_sigma=document.expansion_sigma,
        identity=text_digest(text),
        temperatures=document.temperatures,
    )


def _require_certified(
    path: Path | str, document: ArtefactDocument, field: str, length: float
) -> None:
    if document.certified is None:
        return
    low, high = document.certified
    if not low <= length <= high:
        raise _wrong(
            path,
            field,
            f"has a length of {length:g} mm, and its certificate covers {low:g} to {high:g} mm",
            "Remove what is not certified, or have the artefact calibrated for it.",
        )


def _wrong(path: Path | str, field: str, what: str, remedy: str) -> InputError:
    return InputError("artefact.field", f"{path}: field '{field}' {what}.", remedy)
