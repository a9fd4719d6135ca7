"""Practice of guided procedures with a virtual hand, in separate folders.

In: the request that the station was built from, and the practised procedure.
Out: frames of a hand that performs the current step; the results are never valid.

It must not import a window or command.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Protocol

import msgspec
import numpy as np
import platformdirs

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import records
from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import ProcedureDecision
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.calibration.sweeping import AGAIN, SECOND, SWEEPS, PivotProcedure
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig, load_rig
from ocmm_core.composition import StationRequest
from ocmm_core.composition.hands import BLOCK, IDLE_S, Hand, Watcher
from ocmm_core.documents import write_atomic
from ocmm_core.errors import OcmmError
from ocmm_core.tracking import load_probe
from ocmm_sim import calibration_scenes, sources

_WAIT_S = 0.05


class ShownRig(Protocol):
    """A virtual rig with a finite sequence of frames."""

    @property
    def n_frames(self) -> int:
        """Return how many frames there are."""

    @property
    def frame_period_ns(self) -> int:
        """Return the time from frame to frame, ns."""

    def frames(self, first: int, count: int) -> FrameBlock:
        """Return `count` frames from `first`."""


class PracticeHand(Hand):
    """Hand at the virtual rig for the current step; `make`: a rig for its rest, None if done."""

    def __init__(
        self,
        make: Callable[[], ShownRig | None],
        procedure: Any,
        speed: float,
        failed: Callable[[OcmmError], None],
    ) -> None:
        super().__init__(
            failed, thread="ocmm-practice-hand", safe="All observations are stored.",
            idle_s=_WAIT_S,
        )  # fmt: skip
        self._make, self._procedure, self._speed = make, procedure, speed

    @property
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""
        return "The virtual hand"

    def _wanted(self) -> bool:
        return self._is_wanted(self._procedure.base.step.name)

    def _is_wanted(self, step: str) -> bool:
        base = self._procedure.base
        is_open = base.decision is ProcedureDecision.OPEN
        return is_open and base.step.name == step and not base.step.gate.open

    def _show(self, watcher: Watcher) -> None:
        step = self._procedure.base.step.name
        rig = self._make()
        if rig is None:
            return
        due = time.monotonic()
        for first in range(0, rig.n_frames, BLOCK):
            if self._stop.is_set() or not self._is_wanted(step):
                return
            block = rig.frames(first, min(BLOCK, rig.n_frames - first))
            watcher(block)
            # Stay in place until the touch is recorded.
            while self._procedure.base.live.ready and self._is_wanted(step):
                if self._stop.wait(IDLE_S):
                    return
                due = time.monotonic()
            if self._speed:
                due += len(block) * rig.frame_period_ns * 1e-9 / self._speed
                self._stop.wait(max(due - time.monotonic(), 0.0))


_FIRST_CONE, _SECOND_CONE = (0.0, 0.0, -150.0), (70.0, 10.0, -130.0)
_SECONDS, _REACH_DEG, _REST_S = 30.0, (30.0, 30.0, 13.0), 3.0

Scenes = tuple[calibration_scenes.Scene, ...]


def scenes_of_step(site: sources.VirtualSite, rig: Rig, procedure: Any) -> Scenes:
    """Return the scenes that complete the step of a `_SCENES` kind, or empty."""
    base = procedure.base
    if base.step.gate.open and base.step.wanted == 0:
        return ()
    for kind, scenes in _SCENES.items():
        if isinstance(procedure, kind):
            return scenes(site, rig, procedure).get(base.step.name, ())
    return ()


def _relocation(
    site: sources.VirtualSite, rig: Rig, procedure: RelocationProcedure
) -> Mapping[str, Scenes]:
    found = sources.relocation_by_step(site, rig, procedure.view, procedure.bar, procedure.control)
    return {step: (scene,) for step, scene in found.items()}


def _pivot(site: sources.VirtualSite, _rig: Rig, procedure: PivotProcedure) -> Mapping[str, Scenes]:
    step, view = procedure.base.step.name, procedure.view
    # Resumed sessions get other sweeps.
    begun = view.sweep.poses if view.sweep is not None else 0
    sweep = calibration_scenes.SweepProbe(
        cone=_FIRST_CONE, seconds=_SECONDS, seed=site.seed + 10 * begun, reach_deg=_REACH_DEG
    )
    if step == AGAIN:
        sweep = msgspec.structs.replace(sweep, seconds=_REST_S, reach_deg=(0.0, 0.0, 0.0))
    elif step == SECOND:
        sweep = msgspec.structs.replace(sweep, cone=_SECOND_CONE, seed=sweep.seed + 1)
    return {step: (sweep,)} if step in (*SWEEPS, AGAIN) else {}


def _tip(
    site: sources.VirtualSite, rig: Rig, procedure: TipQualificationProcedure | TipCheckProcedure
) -> Mapping[str, Scenes]:
    scene = sources.scene_of_tip(
        procedure.view, procedure.sphere, rig, site.seed, calibration_scenes.TipFault()
    )
    return {
        "sphere": (msgspec.structs.replace(scene, handles=()),),
        "cone": (msgspec.structs.replace(scene, normals=()),),
    }


_SCENES: Mapping[type, Callable[[sources.VirtualSite, Rig, Any], Mapping[str, Scenes]]] = {
    KnownPointsProcedure: lambda site, _, procedure: {
        "collect": sources.scenes_of_known_points(site, procedure.view, procedure.points)
    },
    RelocationProcedure: _relocation,
    VerificationProcedure: lambda site, rig, procedure: sources.verification_by_step(
        site, rig, procedure.view, procedure.bar, procedure.spheres
    ),
    PivotProcedure: _pivot,
    TipQualificationProcedure: _tip,
    TipCheckProcedure: _tip,
}


PRACTICE_TIP = "1"
_BY = records.practice_name("OCMM")
_GRID = (6, 4, 5)
_SIGMA_MM = 0.0017


def practice_folder() -> Path:
    """Return this user's practice folder, apart from valid records."""
    return platformdirs.user_data_path("ocmm") / "practice"


class Practice:
    """Folders and hand for practice; `speed`: multiple of real time, 0 as fast as processed."""

    def __init__(
        self, request: StationRequest, folder: Path | None = None, speed: float = 1.0
    ) -> None:
        self._request, self._speed = request, speed
        self.folder = folder or practice_folder()
        self._site = sources.VirtualSite(request.rig, request.probe, request.seed, None)

    @property
    def cameras(self) -> Path:
        """Return the folder of the practised calibrations of the rig."""
        return records.store_folder(self.folder / "calibrations", load_rig(self._request.rig).name)

    @property
    def probe(self) -> Path:
        """Return the folder of the practised records of the probe."""
        return records.probe_store_folder(
            self.folder / "probes", load_probe(self._request.probe).name
        )

    @property
    def points(self) -> Path:
        """Return the list of reference points of the virtual machine."""
        return self.folder / "reference_points.csv"

    def prepare(self, now: datetime) -> None:
        """Activate initial records, write the point list; OcmmError: not writable, or altered."""
        rig = load_rig(self._request.rig)
        self.folder.mkdir(parents=True, exist_ok=True)
        write_atomic(self.points, _list_of(rig).encode("utf-8"))
        cameras, probe = records.CalibrationStore(self.cameras), records.ProbeStore(self.probe)
        if cameras.active() is None:
            _put_cameras(cameras, rig, now)
        if not probe.tips:
            _put_probe(probe, self._request.probe, rig, now)

    def hand(self, procedure: Any, failed: Callable[[OcmmError], None]) -> PracticeHand:
        """Return the hand that performs the steps of a procedure."""
        store = records.CalibrationStore(self.cameras)
        record, design = store.active(), load_rig(self._request.rig)
        rig = design if record is None else records.rig_in_force(record, design)

        def make() -> calibration_scenes.CalibrationScenesRig | None:
            scenes = scenes_of_step(self._site, rig, procedure)
            return self._site.script(scenes).build() if scenes else None

        return PracticeHand(make, procedure, self._speed, failed)


def _list_of(rig: Rig) -> str:
    """Return a list of reference points through the whole volume, as from a machine."""
    low, high = rig.volume_world
    cells = (np.array(list(np.ndindex(*_GRID))) + 0.5) / np.array(_GRID)
    # Off the grid, so that no two points lie behind each other for a camera.
    cells = cells + np.random.default_rng(1).uniform(-0.4, 0.4, cells.shape) / np.array(_GRID)
    places = low + cells * (high - low)
    rows = [f"P{n:03d};{x:.4f};{y:.4f};{z:.4f}" for n, (x, y, z) in enumerate(places.tolist())]
    head = f"# ocmm reference points\n# unit: mm\n# uncertainty: {_SIGMA_MM}\n# frame: PRACTICE\n"
    return head + "\n".join(("name;x;y;z", *rows)) + "\n"


def _put_cameras(store: records.CalibrationStore, rig: Rig, now: datetime) -> None:
    """Activate the cameras of the document as verified."""
    (x0, y0, z0), (x1, y1, z1) = rig.volume_world.tolist()
    first = calibration_scenes.made_camera_record()
    sensors = rig.sensors or (0,) * len(rig.cameras)
    record = calibration_scenes.made_camera_record(
        rig=rig.name, made_utc=now.isoformat(), made_by=_BY,
        valid_until_utc=(now + timedelta(days=365)).isoformat(),
        frame_rate_hz=rig.frame_rate_hz, noise=rig.noise,
        cameras=tuple(
            records.entry_of(camera, alias, sensor, rig.device)
            for camera, alias, sensor in zip(rig.cameras, rig.aliases, sensors, strict=True)
        ),
        covariance=tuple(tuple(row) for row in rig.parameter_covariance.tolist()),
        volume_min=(x0, y0, z0), volume_max=(x1, y1, z1),
        residual_maps=first.residual_maps[:1] * len(rig.cameras),
    )  # fmt: skip
    store.accept(record, _BY, "to practise with", now)
    good = msgspec.structs.replace(
        calibration_scenes.made_verification(record), made_utc=now.isoformat(), made_by=_BY
    )
    store.verify(good, now)


def _put_probe(store: records.ProbeStore, document: Path, rig: Rig, now: datetime) -> None:
    """Activate the probe of the document as qualified."""
    body = load_probe(document)
    x, y, z = body.tip_probe.tolist()
    record = calibration_scenes.made_probe_record(
        probe=body.name, tip=PRACTICE_TIP, made_utc=now.isoformat(), made_by=_BY,
        valid_until_utc=(now + timedelta(days=365)).isoformat(), rig=rig.name,
        rig_identity=rig.identity, probe_identity=body.identity,
        leds_mm=tuple((a, b, c) for a, b, c in body.leds_probe.tolist()), tip_mm=(x, y, z),
        covariance=tuple(tuple(row) for row in body.geometry_covariance.tolist()),
    )  # fmt: skip
    store.calibrate(record, _BY, "to practise with", now)
    good = calibration_scenes.made_tip_record(
        record, made_by=_BY, made_utc=now.isoformat(),
        diameter_mm=2.0 * body.tip_radius, diameter_sigma_mm=0.0045,
    )  # fmt: skip
    store.qualify(good, now)
