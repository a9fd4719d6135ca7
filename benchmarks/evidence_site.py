"""Stores with a history, whole and VALID, for `benchmarks.evidence` to damage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.calibration.records import NAME as SEAL
from ocmm_core.calibration.records import (
    CalibrationStore,
    CalibrationView,
    ProbeStore,
    ProbeView,
    judge,
    open_calibration,
    open_probe,
    record_hash,
)
from ocmm_core.documents import resource
from tests.core.calibration.made_probe_records import (
    PROBE,
    make_probe_record,
    make_tip_check,
    make_tip_record,
)
from tests.core.calibration.made_records import MADE, RIG, make_record, make_verification

EVENTS = "events.jsonl"
RIG_DOCUMENT = resource("rigs", "recommended.toml")
PROBE_DOCUMENT = resource("probes", "standard.toml")
NOW = MADE + timedelta(days=2)

View = CalibrationView | ProbeView
Look = Callable[[], View]
"""Returns the view at `NOW`."""


@dataclass(slots=True)
class Store:
    """One store as it stands, and as it stood before.

    Attributes
    ----------
    kind
        ``"cameras"`` or ``"probe"``.
    folder
        Where it is.
    files
        What every file holds, by its name below the folder.
    earlier
        What the chain and its seal held after each event before the last one, oldest first.
    """

    kind: str
    folder: Path
    files: dict[str, bytes] = field(default_factory=dict)
    earlier: dict[str, list[bytes]] = field(default_factory=lambda: {EVENTS: [], SEAL: []})

    def begin(self) -> Look:
        """Open it as a new job does; the result polls it like a running job."""
        if self.kind == "cameras":
            cameras = open_calibration(RIG_DOCUMENT, self.folder.parent)
            return lambda: judge(cameras, NOW)
        probe = open_probe(PROBE_DOCUMENT, self.folder.parent)
        return lambda: judge(probe, NOW)

    def role(self, name: str) -> str:
        """Return the role of a file."""
        if name == EVENTS:
            return "history"
        if name == SEAL:
            return "seal"
        return "session" if name.startswith("sessions/") else "record"

    def keep(self) -> None:
        """Record the present content, after an event."""
        if self.files:
            for name, versions in self.earlier.items():
                versions.append(self.files[name])
        self.files = {
            path.relative_to(self.folder).as_posix(): path.read_bytes()
            for path in sorted(self.folder.rglob("*"))
            if path.is_file()
        }

    def session(self, name: str) -> Path:
        """Write a session file as a procedure leaves it behind."""
        path = self.folder / "sessions" / f"{name}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = (
            msgspec.json.encode({"number": number, "of": f"{self.folder}", "spot": 0.25 * number})
            for number in range(40)
        )
        path.write_bytes(b"\n".join(lines) + b"\n")
        return path


def cameras_in(folder: Path, shift: int) -> Store:
    """Return calibrations of a rig; ``shift`` tells the serial numbers of one rig from another's.

    Calibrated and verified, put in doubt and failed, then relocated, failed once and verified.
    """
    at = Store("cameras", folder / RIG.name)
    store = CalibrationStore(at.folder)
    entries = tuple(
        msgspec.structs.replace(one, serial=one.serial + shift) for one in make_record().cameras
    )
    first = make_record(cameras=entries, points=400 + shift)
    second = make_record(
        cameras=entries, points=300 + shift, method="relocation", previous=record_hash(first)
    )

    def when(hours: int) -> datetime:
        return MADE + timedelta(hours=hours)

    store.accept(first, "technician", "new", when(0), at.session("known-points"))
    at.keep()
    store.verify(make_verification(first), when(1), at.session("verification-1"))
    at.keep()
    store.suspect("monitor", "Camera 'left' has turned.", when(1), when(2))
    at.keep()
    failed = make_verification(first, passed=False)
    store.verify(failed, when(3), at.session("verification-2"))
    at.keep()
    store.accept(second, "technician", "moved", when(4), at.session("relocation"))
    at.keep()
    failed = make_verification(second, passed=False)
    store.verify(failed, when(5), at.session("verification-3"))
    at.keep()
    store.verify(make_verification(second), when(6), at.session("verification-4"))
    at.keep()
    return at


def probe_in(folder: Path, shift: int) -> Store:
    """Return records of a probe; ``shift`` tells one probe from another.

    Calibrated, qualified, mounted, failed its check, qualified anew and checked.
    """
    at = Store("probe", folder / PROBE.name)
    store = ProbeStore(at.folder)
    identity = PROBE.identity if not shift else "e" * 64
    record = make_probe_record(probe_identity=identity, frames=1000 + shift)
    qualified = make_tip_record(record)
    again = make_tip_record(record, points=26)

    def when(hours: int) -> datetime:
        return MADE + timedelta(hours=hours)

    store.calibrate(record, "technician", "new", when(0), at.session("pivot"))
    at.keep()
    store.qualify(qualified, when(1), at.session("tip-1"))
    at.keep()
    store.mount(record.tip, "inspector", when(2))
    at.keep()
    failed = make_tip_check(record, qualified, passed=False)
    store.check(failed, when(3), at.session("check-1"))
    at.keep()
    store.qualify(again, when(4), at.session("tip-2"))
    at.keep()
    store.check(make_tip_check(record, again), when(5), at.session("check-2"))
    at.keep()
    return at
