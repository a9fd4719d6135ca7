"""Verifications of the virtual rig: honest ones, nudged cameras, wrong bars and tips.

    python -m benchmarks.verifying [--n 100]

Each run draws its own cameras, probe, patterns and noise; the calibration in force is that of the
documents, so that its stated uncertainty is the error of the rig. Each session is the whole guided
procedure, with two seats, seven lines, a sphere and the seats again, from averaged spots. A camera
is nudged by a turn about an axis across its view: 30 urad are 0.06 px, 100 urad 0.2 px.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.records import (
    SCHEMA,
    CalibrationStore,
    CameraRecord,
    LengthBar,
    VerificationRecord,
    entry_of,
    load_bar,
    load_sphere,
    rig_from_record,
)
from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup
from ocmm_core.camera import Rig, load_rig
from ocmm_core.composition import RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe
from tests.core.calibration.verifying_at_once import FRAMES, nudge, verify_at_once
from tests.core.calibration.virtual_rests import Holds, VirtualRests

BEGIN = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
RESTS = 2 + 42 + 25 + 2
_WRONG_TIP_MM = 0.3
_WRONG_BAR = 3e-4


@dataclass(frozen=True, slots=True)
class Scene:
    """One kind of session.

    Attributes
    ----------
    name
        In words.
    nudge_rad
        Turn of one camera at a random moment; zero for none.
    tip_mm
        How far the tip stands elsewhere than its record says.
    scale
        Of the bar against its document.
    wanted
        Share of sessions that must be refused, or, for the honest ones, that must pass.
    codes
        One of these objections must name the reason.
    """

    name: str
    nudge_rad: float = 0.0
    tip_mm: float = 0.0
    scale: float = 1.0
    wanted: float = 1.0
    codes: tuple[str, ...] = ()


_MOVED = ("session.camera_moved",)
SCENES = (
    Scene("honest", wanted=0.97),
    Scene("nudged by 30 urad (0.06 px)", nudge_rad=30e-6, wanted=0.90, codes=_MOVED),
    Scene("nudged by 50 urad (0.1 px)", nudge_rad=50e-6, wanted=0.95, codes=_MOVED),
    Scene("nudged by 100 urad (0.2 px)", nudge_rad=100e-6, wanted=1.0, codes=_MOVED),
    Scene("bar 0.03 % too long", scale=1.0 + _WRONG_BAR, codes=("verification.scale",)),
    Scene("tip 0.3 mm elsewhere", tip_mm=_WRONG_TIP_MM, codes=("verification.tip",)),
)


class Site:
    """The recommended rig with a calibration in force."""

    def __init__(self, folder: Path) -> None:
        self.design = load_rig(RECOMMENDED_RIG)
        self.body = load_probe(STANDARD_PROBE)
        self.bar: LengthBar = load_bar(resource("artefacts", "verification_bar.toml"))
        self.sphere = load_sphere(resource("artefacts", "sphere.toml"))
        self.folder, self.holds = folder, Holds()
        self.store = CalibrationStore(folder / "store")
        record = _record(self.design)
        self.store.accept(record, "benchmark", "in force", BEGIN)
        self.rig = rig_from_record(record)

    def run(self, scene: Scene, number: int) -> tuple[VerificationRecord, str, datetime]:
        """Return the record, the camera that was nudged, and when."""
        begin = BEGIN + timedelta(days=1, hours=number)
        procedure = VerificationProcedure.start(
            SessionSite(self.folder / scene.name[:12], self.rig, self.body, self.store.folder),
            VerificationSetup(who="benchmark", spheres=(self.sphere,), bar=self.bar),
            begin,
        )
        rng = np.random.default_rng([number, 77])
        spots = VirtualRests(self.design, self.body, number, FRAMES, self.holds)
        direction = rng.standard_normal(3)
        spots.tip_shift_probe = scene.tip_mm * direction / np.linalg.norm(direction)
        # Before the first rest a nudge is an error of the calibration, not a change.
        moment, moved = int(rng.integers(1, RESTS)), [0]

        def before(rest: int) -> None:
            if scene.nudge_rad and rest == moment:
                moved[0] = nudge(spots, scene.nudge_rad, rng)

        verify_at_once(procedure, spots, begin, number, scale=scene.scale, before=before)
        procedure.compute()
        outcome = procedure.view.outcome
        assert outcome is not None
        # A rest takes 15 s and ends with its observation.
        when = begin + timedelta(seconds=15 * moment)
        return outcome.record, self.rig.cameras[moved[0]].name, when


def main() -> int:
    """Print the table and return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=100, help="Sessions of each kind.")
    parser.add_argument("--only", default="", help="Only scenes whose name holds this.")
    options = parser.parse_args()
    broken = 0
    with tempfile.TemporaryDirectory() as folder:
        site = Site(Path(folder))
        for scene in SCENES:
            if options.only in scene.name:
                broken += not _table(site, scene, options.n)
    return 1 if broken else 0


def _table(site: Site, scene: Scene, n: int) -> bool:
    """Run one kind of session, print what became of it, and return whether it kept its limit."""
    passed = named = right = 0
    largest, forms = [], []
    codes: Counter[str] = Counter()
    for number in range(n):
        record, camera, _ = site.run(scene, number)
        passed += record.passed
        found = {one.code for one in record.objections}
        codes.update(found)
        named += bool(found & set(scene.codes))
        right += any(f"'{camera}'" in one.what for one in record.objections)
        largest.append(max(abs(one.error_mm) for one in record.checks[:-2]))
        forms.append(record.checks[-1].error_mm)
    honest = not scene.codes
    share = (passed if honest else n - passed) / n
    good = share >= scene.wanted
    print(
        f"{scene.name:30} {'passed' if honest else 'refused'} {100.0 * share:5.1f} % of N = {n} "
        f"(limit {100.0 * scene.wanted:.0f} %) {'ok' if good else 'BROKEN'}"
    )
    if not honest:
        print(f"{'':30} reason named in {named} of {n}", end="")
        print(f", camera right in {right} of {n}" if scene.nudge_rad else "")
    print(
        f"{'':30} largest error of a length {1e3 * np.median(largest):.0f} um median, "
        f"{1e3 * max(largest):.0f} um at most; form {1e3 * np.median(forms):.0f} and "
        f"{1e3 * max(forms):.0f} um; objections {dict(codes)}",
        flush=True,
    )
    return good


def _record(rig: Rig) -> CameraRecord:
    """Return a calibration record with the data of the rig document."""
    low, high = (tuple(float(v) for v in corner) for corner in rig.volume_world)
    content = {
        "schema": SCHEMA, "rig": rig.name, "method": "known points",
        "made_utc": BEGIN.isoformat(), "valid_until_utc": "2099-01-01T00:00:00+00:00",
        "made_by": "benchmark", "software": "benchmark", "temperature_c": 20.0,
        "frame_rate_hz": rig.frame_rate_hz, "noise": rig.noise,
        "cameras": [entry_of(c, a) for c, a in zip(rig.cameras, rig.aliases, strict=True)],
        "covariance": rig.parameter_covariance.tolist(), "volume_min": low, "volume_max": high,
        "hull": [], "residual_maps": [], "rms_px": 0.0, "chi2_per_dof": 1.0, "points": 250,
        "outliers": [], "data_sha256": "0" * 64, "artefacts": [], "previous": "",
    }  # fmt: skip
    return msgspec.convert(msgspec.to_builtins(content), CameraRecord)


if __name__ == "__main__":
    sys.exit(main())
