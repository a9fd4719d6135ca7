"""Guided calibration of a tracker: a minute at rest, then the probe at rest all over the volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TypeAlias

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.cameras import _tracker_noise as tracker_noise
from ocmm_core.calibration.records import (
    SCHEMA,
    ArtefactUse,
    CalibrationStore,
    CameraRecord,
    entry_of,
    let_pass,
    record_hash,
)
from ocmm_core.camera import TrackerDocument, locate_markers, tracker_rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, triple
from ocmm_core.tracking import solve

PREPARE, REST, SPREAD, RESULT = "prepare", "rest", "places", "result"
PLACES = 20
_REST_S = 30.0
"""Each half of the window at rest."""
_APART_MM = 50.0
_SPAN = 0.6
"""Share of each edge of the volume over which the places extend."""


class TrackerBegun(guided.SessionHeader, frozen=True, kw_only=True):
    """First line."""

    probe_identity: str
    valid_days: int


class TrackerRested(guided.SessionEvent, frozen=True, kw_only=True):
    """Noise of the markers at rest."""

    noise: tracker_noise.RestNoise


class TrackerPlaceTaken(guided.SessionEvent, frozen=True, kw_only=True):
    """The resting probe at one place."""

    uv: guided.Spots
    """(C, L), px, of the views that stand for the tracker."""
    sigma_px: float


TrackerEvent: TypeAlias = TrackerBegun | TrackerRested | TrackerPlaceTaken


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerSetup(guided.SessionSetup):
    valid_days: int = 365


class TrackerProcedure(
    guided.CameraProcedure[TrackerEvent, guided.CalibrationOutcome, TrackerBegun, TrackerSetup]
):
    """See `procedure`."""

    kind = guided.ProcedureKind.TRACKER
    for_cameras, for_trackers = False, True
    sessions = guided.SessionFormat(kind, guided.SessionLine[TrackerEvent], TrackerBegun)
    step_names = (PREPARE, REST, SPREAD, RESULT)

    def __init__(
        self,
        site: guided.SessionSite,
        chain: ChainFile[guided.SessionLine[TrackerEvent]],
        begun: TrackerBegun,
    ) -> None:
        super().__init__(site, chain, begun)
        guided.require_probe(chain.path, begun.probe_identity, site.body)
        self._body = site.body
        self._rested: list[TrackerRested] = []
        self._taken: list[TrackerPlaceTaken] = []
        self._tips: list[Float] = []
        frames = round(_REST_S * site.rig.frame_rate_hz)
        self._still, self._probe = (
            guided.ProbeSpotAverager(
                site.rig, site.body, count, resting=True, distance_mm=_APART_MM, inside=True
            )
            for count in (frames, guided.STILL_FRAMES)
        )
        self._fold()

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: TrackerSetup, now: datetime
    ) -> dict[str, object]:
        return {"probe_identity": site.body.identity, "valid_days": setup.valid_days}

    @property
    def view(self) -> guided.TrackerView:
        with self._lock:
            tips = np.array(self._tips).reshape(-1, 3)
            return guided.TrackerView(self.base, tips, self._outcome)

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            (self._still if self._step == REST else self._probe).push(block)

    def _seen(self) -> guided.Live:
        return (self._still if self._step == REST else self._probe).live()

    def _wants(self) -> bool:
        return self._step == SPREAD or (self._step == REST and not self._rested)

    def _observation(self, utc: str) -> TrackerEvent:
        if self._step == REST:
            places = locate_markers(self.rig.cameras, self._still.spots())
            return TrackerRested(utc=utc, noise=tracker_noise.rest_noise(places, self._document))
        average = self._probe.average()
        return TrackerPlaceTaken(utc=utc, uv=guided.to_spots(average.uv), sigma_px=average.sigma_px)

    def _observe(self, event: TrackerEvent) -> None:
        if isinstance(event, TrackerRested):
            self._rested.append(event)
        elif isinstance(event, TrackerPlaceTaken):
            self._taken.append(event)
            uv = guided.from_spots(event.uv)
            pose = solve(uv[None], self.rig, self._body, event.sigma_px)
            self._tips.append(pose.tip_world[0])
            self._probe.taken(guided.Average(uv, event.sigma_px))

    def _has_observation(self, step: str) -> bool:
        return bool(self._rested if step == REST else self._taken if step == SPREAD else ())

    def _undo(self, step: str) -> None:
        if step == REST:
            self._rested.pop()
        else:
            self._taken.pop()
            self._tips.pop()

    def _steps_rest_on(self) -> object:
        return ()

    @property
    def _document(self) -> TrackerDocument:
        assert self.rig.markers is not None  # noqa: S101 - checked at the start
        return self.rig.markers.document

    def _steps(self) -> tuple[guided.Step, ...]:
        return (
            guided.Step(
                PREPARE,
                "Prepare",
                "Let the tracker warm up, switch off averaging, smoothing and prediction, and "
                "clamp the probe in the middle of the volume.",
                guided.OPEN,
            ),
            guided.Step(
                REST, "A minute at rest", "Leave the clamped probe alone for a minute.",
                self._rest_gate(), len(self._rested), 1,
            ),
            guided.Step(
                SPREAD, "Places",
                "Let the ball rest at places all over the volume, low and high, near and far, with "
                "another tilt of the probe each time.",
                self._places_gate(), len(self._taken), PLACES,
            ),
            guided.Step(
                RESULT,
                "Result",
                "Compare the measured noise with the stated one, then accept it or keep the old "
                "one.",
                guided.LAST_OF_CALIBRATION,
            ),
        )  # fmt: skip

    def _rest_gate(self) -> guided.Gate:
        if not self._rested:
            return guided.Gate(False, "The minute at rest is missing.", "Leave the probe alone.")
        for one in tracker_noise.rest_findings(self._rested[-1].noise):
            return guided.Gate(False, one.what, one.remedy)
        return guided.OPEN

    def _places_gate(self) -> guided.Gate:
        if len(self._taken) < PLACES:
            return guided.Gate(
                False, f"{len(self._taken)} of {PLACES} places are taken.", "Take the others."
            )
        low, high = self.rig.volume_world
        span = np.ptp(self._tips, axis=0) / (high - low)
        if span.min() < _SPAN:
            return guided.Gate(
                False,
                f"The places extend over {100.0 * span.min():.0f} % of the volume along "
                f"{'XYZ'[int(span.argmin())]}; {100.0 * _SPAN:.0f} % are needed.",
                "Take more places at its ends.",
            )
        return guided.OPEN

    def _calculation(self) -> Callable[[], guided.CalibrationOutcome]:
        rig, body, begun, stated = self.rig, self._body, self._begun, self._document
        rest, taken = self._rested[-1].noise, tuple(self._taken)

        def calculate() -> guided.CalibrationOutcome:
            let_pass(tracker_noise.rest_findings(rest), force=False)
            uv = np.array([guided.from_spots(one.uv) for one in taken])
            places = locate_markers(rig.cameras, uv)
            document = tracker_noise.measured_document(stated, rest, places, body)
            record = tracker_record(
                document, datetime.fromisoformat(taken[-1].utc), begun.valid_days, begun.who,
                begun.software, begun.temperature_c, guided.hash_of(uv), (), begun.running,
                len(taken),
            )  # fmt: skip
            return guided.CalibrationOutcome(
                record, tracker_rig(document, record_hash(record)), (), np.empty((0, 3)),
                np.empty((0, 3)), tuple(tracker_noise.changes(stated, document)), None,
            )  # fmt: skip

        return calculate

    def _put(self, outcome: guided.CalibrationOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.accept(outcome.record, self._begun.who, decided.reason, now, self._log.path)


def tracker_record(
    document: TrackerDocument, made: datetime, valid_days: int, who: str, software: str,
    temperature_c: float | None, data_sha256: str, artefacts: tuple[ArtefactUse, ...],
    previous: str, points: int,
) -> CameraRecord:  # fmt: skip
    """Return the record of a tracker with measured noise; InputError if that is implausible."""
    rig = tracker_rig(document, "", "the measured noise")
    low, high = rig.volume_world
    corners = np.array(np.meshgrid(*np.array([low, high]).T)).reshape(3, -1).T
    return CameraRecord(
        schema=SCHEMA, rig=document.name, method="tracker", made_utc=guided.utc_text(made),
        valid_until_utc=guided.utc_text(made + timedelta(days=valid_days)), made_by=who,
        software=software, temperature_c=temperature_c, frame_rate_hz=document.frame_rate_hz,
        noise=rig.noise,
        cameras=tuple(
            entry_of(camera, alias) for camera, alias in zip(rig.cameras, rig.aliases, strict=True)
        ),
        covariance=tuple(map(tuple, rig.parameter_covariance.tolist())),
        volume_min=document.volume_min, volume_max=document.volume_max,
        hull=tuple(triple(one) for one in corners), residual_maps=(), rms_px=rig.noise.white_px,
        chi2_per_dof=1.0, points=points, outliers=(), data_sha256=data_sha256,
        artefacts=artefacts, previous=previous, tracker=document,
    )  # fmt: skip


def correct_scale(store: CalibrationStore, who: str, reason: str, now: datetime) -> CameraRecord:
    """Correct the scale of a tracker by its last verification, which failed; return the record.

    The new calibration is in force, and SUSPECT until a verification with another artefact has
    passed. CalibrationError without such a verification.
    """
    active, verifications = store.active(), store.verifications()
    last = verifications[-1] if verifications else None
    if active is None or isinstance(active.tracker, msgspec.UnsetType):
        raise CalibrationError(
            "tracker.scale_cameras", "No tracker is calibrated there.", "Calibrate the tracker."
        )
    if (
        last is None or last.scale is None or last.calibration != store.active_hash
        or not any(one.code == "verification.scale" for one in last.objections)
    ):  # fmt: skip
        raise CalibrationError(
            "tracker.scale_passed",
            "The last verification of the calibration in force found no wrong scale.",
            "Verify it; only lengths that are all wrong alike correct a scale.",
        )
    before = active.tracker.noise
    noise = msgspec.structs.replace(
        before, scale=before.scale / (1.0 + last.scale.relative), scale_sigma=last.scale.sigma
    )
    record = tracker_record(
        msgspec.structs.replace(active.tracker, noise=noise), now,
        (datetime.fromisoformat(active.valid_until_utc)
         - datetime.fromisoformat(active.made_utc)).days,
        who, last.software, last.temperature_c, last.data_sha256, last.artefacts,
        record_hash(active), active.points,
    )  # fmt: skip
    store.accept(record, who, reason, now)
    return record
