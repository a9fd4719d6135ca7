"""Artefact register: this user's spheres, bars, gauge blocks and parts.

One chain file: nothing is overwritten, concurrent writers are detected.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import msgspec
import platformdirs

from ocmm_core.acceptance._result import UsedArtefact
from ocmm_core.acceptance._temperature_source import TemperatureSource
from ocmm_core.calibration.guided import utc_text
from ocmm_core.calibration.probe_design import HIGHEST_C, LARGEST_U_K, LOWEST_C
from ocmm_core.calibration.records import ArtefactUse, LengthBar, Sphere
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import Document, load_with_text, text_digest
from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals import KnownEnd, SealState, Signed, recall, remember

ARTEFACT_SCHEMA = "ocmm.artefact/1"

ArtefactKind: TypeAlias = Literal[
    "sphere", "bar", "gauge block", "part", "plate", "dumbbell", "thermometer"
]
ARTEFACT_KINDS: tuple[ArtefactKind, ...] = get_args(ArtefactKind)
_SIZES: dict[str, tuple[int, int]] = {
    "sphere": (1, 1),
    "bar": (2, 100),
    "gauge block": (1, 1),
    "part": (1, 1000),
    "plate": (1, 1),
    "dumbbell": (3, 3),
    "thermometer": (0, 0),
}
_LARGEST_EXPANSION = 1e-4
_ATTEMPTS = 5
REGISTER = "artefacts.chain"
_NEWEST = "newest-artefact-register"
"""Name of the register of this station in its memory."""
_ADD = "ocmm artefact add --replace --who NAME."
NOT_SIGNED_REMEDY = f"Compare it with its certificate, then enter it again: {_ADD}"
_ENTER_AGAIN = f"If there is none, enter each artefact again from its certificate: {_ADD}"


class ArtefactEntry(Document, frozen=True, kw_only=True):
    """A registered calibrated artefact; mm at 20 degrees; U with k = 2, kelvin for thermometers."""

    id: str
    """Name in commands."""
    kind: ArtefactKind
    name: str
    maker: str = ""
    serial: str
    laboratory: str
    certificate: str
    certificate_sha256: str = ""
    """`laboratory`, `certificate`, `certificate_sha256`: issuer, number, hash of the file."""
    due_utc: str
    """Expiry, ISO 8601 text."""
    sizes: tuple[float, ...]
    """Diameter of a sphere; nests of a bar; length of a block; two diameters and the distance of a
    dumbbell; certified values of a part."""
    expanded: float
    expanded_per_length: float = 0.0
    """`expanded`, `expanded_per_length`: U: constant and length-dependent part."""
    form: float = 0.0
    """Certified form error; zero if within U."""
    expansion: float
    expansion_sigma: float
    """`expansion`, `expansion_sigma`: 1/K."""
    temperatures: tuple[float, float] = (10.0, 35.0)
    """Validity of the certificate, degrees Celsius."""
    supports: str = ""
    source: str = "typed"
    """"typed", or the file that it was read from."""
    reads: TemperatureSource | None = None
    """Where a thermometer is read; None if its readings are typed."""

    def used(self, role: str | None = None) -> UsedArtefact:
        """Return the artefact in the form used by tests."""
        return UsedArtefact(
            role=role or self.kind,
            use=ArtefactUse(
                name=self.name,
                serial=self.serial,
                certificate=self.certificate,
                certificate_sha256=self.certificate_sha256,
                due_utc=_moment(self.due_utc).isoformat(),
            ),
            laboratory=self.laboratory,
            sizes=self.sizes,
            expanded=self.expanded,
            expanded_per_length=self.expanded_per_length,
            form=self.form,
            expansion=self.expansion,
            expansion_sigma=self.expansion_sigma,
            temperatures=self.temperatures,
            supports=self.supports,
            identity="",
        )


class _Change(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    utc: str
    who: str
    removed: str = ""
    added: ArtefactEntry | None = None


class ArtefactRegister:
    """Register of a folder, empty without a file; StorageError if altered or lost.

    `restarts`: Accept that the former register of this station is lost.
    """

    def __init__(self, folder: Path | None = None, *, restarts: bool = False) -> None:
        self.path = (folder or default_artefact_folder()) / REGISTER
        self._own, self._restarts = folder is None, restarts
        self._lost = ""
        self._read()

    def _read(self) -> None:
        self._chain: ChainFile[_Change] = ChainFile(
            self.path, _Change, signed=Signed.ARTEFACTS, remembered=True
        )
        self._require_newest()

    def _require_newest(self) -> None:
        """Raise StorageError if this station used another register with later changes."""
        if not self._own:
            return
        seen = recall(_NEWEST)
        self._lost = ""
        if not self._chain.items:
            if seen is not None:
                # Kept in the first line of the next register.
                self._lost = f"the lost register of {seen.moment[:10]}"
            if seen is not None and not self._restarts:
                raise StorageError(
                    "artefact.lost",
                    f"{self.path}: the artefact register of this station, last changed on "
                    f"{seen.moment[:10]}, is missing.",
                    f"Restore it from a backup. {_ENTER_AGAIN}",
                )
            return
        first, utc = self._chain.links[0], self._chain.items[-1].utc
        if (
            seen is not None
            and seen.link != first
            and datetime.fromisoformat(seen.moment) > datetime.fromisoformat(utc)
        ):
            raise StorageError(
                "artefact.older",
                f"{self.path}: this register is older than the one that this station used last "
                f"({seen.moment[:10]}).",
                f"Restore the newest copy, or move this file away. {_ENTER_AGAIN}",
            )
        remember(KnownEnd(name=_NEWEST, count=1, link=first, moment=utc), sync=False)

    @property
    def signer(self) -> SealState:
        """Return the signature state of the whole register."""
        return self._chain.signer

    @property
    def changes(self) -> tuple[tuple[str, str, str], ...]:
        """Return all changes, oldest first: UTC, name, text."""
        return tuple((one.utc, one.who, _change_words(one)) for one in self._chain.items)

    def faults(self) -> dict[str, str]:
        """Return entries whose own line lacks a trusted signature, with reasons."""
        found: dict[str, str] = {}
        for change, signer in zip(self._chain.items, self._chain.signers(), strict=True):
            for name in (change.removed, "" if change.added is None else change.added.id):
                found.pop(name, None)
            if change.added is not None and not signer.sound:
                found[change.added.id] = signer.fault
        return found

    def used(self, name: str) -> UsedArtefact:
        """Return an artefact for a test; InputError if unknown or not trusted."""
        entry, fault = self.entry(name), self.faults().get(name)
        if fault is not None:
            raise InputError(
                "artefact.not_signed", f"Artefact '{name}': {fault}", NOT_SIGNED_REMEDY
            )
        return entry.used()

    @property
    def entries(self) -> dict[str, ArtefactEntry]:
        """Return the current entries by id, in the order of addition."""
        found: dict[str, ArtefactEntry] = {}
        for change in self._chain.items:
            if change.removed:
                found.pop(change.removed, None)
            if change.added is not None:
                found[change.added.id] = change.added
        return found

    def entry(self, name: str) -> ArtefactEntry:
        """Return an artefact by its id; raise InputError if absent."""
        found = self.entries.get(name)
        if found is None:
            known = ", ".join(self.entries) or "none yet"
            raise InputError(
                "artefact.unknown", f"There is no artefact '{name}'.", f"Give one of: {known}."
            )
        return found

    def add(self, entry: ArtefactEntry, who: str, now: datetime, *, replace: bool = False) -> None:
        """Add an artefact, or replace its certificate by a newer one.

        Raises InputError if a field is implausible, the certificate expired, or the id is in use.
        """
        check_entry(entry, "artefact")
        if _moment(entry.due_utc) <= now:
            raise InputError(
                "artefact.expired",
                f"The certificate of '{entry.name}' expired on {entry.due_utc[:10]}.",
                "Have it calibrated; it cannot be used before.",
            )

        def change() -> _Change:
            if entry.id in self.entries and not replace:
                raise InputError(
                    "artefact.taken",
                    f"There is an artefact '{entry.id}' already.",
                    "Give --replace with its new certificate, or another id.",
                )
            before = self.entries.get(entry.id)
            added = entry
            if before is not None and entry.kind == before.kind and entry.reads is None:
                # A new certificate does not change where the thermometer is read.
                added = msgspec.structs.replace(entry, reads=before.reads)
            return _Change(utc=utc_text(now), who=who, removed=self._lost, added=added)

        self._write(change)

    def remove(self, name: str, who: str, now: datetime) -> None:
        """Remove an artefact; its lines stay. Raise InputError if absent."""

        def change() -> _Change:
            self.entry(name)
            return _Change(utc=utc_text(now), who=who, removed=name)

        self._write(change)

    def _write(self, change: Callable[[], _Change]) -> None:
        for attempt in range(_ATTEMPTS):
            made = change()
            try:
                self._chain.append(made)
            except StorageError as error:
                # Another program wrote meanwhile: check again with its entries.
                if error.code != "chain.elsewhere" or attempt == _ATTEMPTS - 1:
                    raise
                self._read()
            else:
                self._require_newest()
                return


def _change_words(change: _Change) -> str:
    if change.added is None:
        return f"removed {change.removed}"
    lost = f" in place of {change.removed}" if change.removed else ""
    return f"added {change.added.id}, certificate {change.added.certificate}{lost}"


def default_artefact_folder() -> Path:
    return platformdirs.user_data_path("ocmm") / "artefacts"


def load_artefact(path: Path | str) -> ArtefactEntry:
    """Return the artefact of a document (`ocmm.artefact/1`); InputError if invalid."""
    return _checked_artefact(path)[0]


def _checked_artefact(path: Path | str) -> tuple[ArtefactEntry, str]:
    entry, text = load_with_text(path, ArtefactEntry, ARTEFACT_SCHEMA)
    check_entry(entry, str(path))
    return entry, text_digest(text)


def check_entry(entry: ArtefactEntry, where: str) -> None:
    """Raise InputError for implausible fields."""
    few, many = _SIZES[entry.kind]
    sizes = entry.sizes
    low, high = entry.temperatures
    thermometer = entry.kind == "thermometer"
    wrong = {
        "id": not entry.id or not entry.id.replace("-", "").replace("_", "").isalnum(),
        "kind": entry.kind not in get_args(ArtefactKind),
        "serial": not any(letter.isalnum() for letter in entry.serial),
        "certificate": not entry.certificate.strip(),
        "sizes": not few <= len(sizes) <= many
        or not all(math.isfinite(one) and abs(one) < 1e5 for one in sizes)
        or (entry.kind == "bar" and any(b <= a for a, b in pairwise(sizes)))
        or (entry.kind not in ("bar", "part") and not all(0.0 < one < 1e5 for one in sizes)),
        "expanded": not 0.0 < entry.expanded < (LARGEST_U_K if thermometer else 1.0),
        "expanded_per_length": not 0.0 <= entry.expanded_per_length < 1e-3,
        "form": not 0.0 <= entry.form < 1.0,
        "expansion": not -_LARGEST_EXPANSION <= entry.expansion <= _LARGEST_EXPANSION,
        "expansion_sigma": not 0.0 <= entry.expansion_sigma <= _LARGEST_EXPANSION,
        "temperatures": not LOWEST_C <= low < high <= HIGHEST_C,
    }
    for field, is_wrong in wrong.items():
        if is_wrong:
            raise InputError(
                "artefact.field",
                f"{where}: field '{field}' is {getattr(entry, field)!r}, which cannot be meant.",
                "Correct that field; see docs/quality/acceptance.md for what it holds.",
            )
    if entry.reads is not None:
        if not thermometer:
            raise InputError(
                "artefact.field",
                f"{where}: field 'reads' is for thermometers, not for a {entry.kind}.",
                "Leave it out.",
            )
        entry.reads.check(where)
    try:
        _moment(entry.due_utc)
    except ValueError as error:
        raise InputError(
            "artefact.field",
            f"{where}: field 'due_utc' is no date.",
            "Write it like 2030-12-31T00:00:00+00:00.",
        ) from error


def used_bar(bar: LengthBar) -> UsedArtefact:
    """Return a document's length bar in the form used by tests."""
    return _used("bar", bar, bar.nests)


def used_sphere(sphere: Sphere) -> UsedArtefact:
    """Return a document's sphere in the form used by tests."""
    return _used("sphere", sphere, (sphere.diameter,))


def load_used(path: Path) -> UsedArtefact:
    """Return a register document's artefact in the form used by tests."""
    entry, identity = _checked_artefact(path)
    return msgspec.structs.replace(entry.used(), identity=identity)


def _used(role: str, one: LengthBar | Sphere, sizes: tuple[float, ...]) -> UsedArtefact:
    known = one.artefact
    return UsedArtefact(
        role=role, use=known.use, sizes=sizes, expanded=known.expanded,
        expanded_per_length=known.expanded_per_length, expansion=known.expansion,
        expansion_sigma=known.expansion_sigma, temperatures=known.temperatures,
        identity=known.identity,
    )  # fmt: skip


def _moment(text: str) -> datetime:
    moment = datetime.fromisoformat(text)
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment
