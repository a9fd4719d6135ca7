"""Monitor a calibration in use: examine looks of the last two seconds and of the last minute.

A learnt baseline is stored in a file with its calibration, for one probe.
"""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.monitor._baseline import Baseline, pattern_maps
from ocmm_core.calibration.monitor._drift_decision import (
    EVERY,
    LOOK_NS,
    LOOKS,
    SPARSE,
    UNFIT_NS,
    ChangeCause,
    DriftReport,
    examine,
)
from ocmm_core.calibration.monitor._residual_samples import (
    Belief,
    PixelNoise,
    ResidualAccumulator,
    ResidualSample,
)
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.camera import Rig
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import FrameStatus, ProbeBody, TrackBlock

SCHEMA = "ocmm.sensor-baseline/1"

_LAG = 4
"""Looks are compared with those some pixels before, of a hand that rests."""


class _Content(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    calibration: str
    probe: str
    looks: int
    left_px: float
    maps: tuple[ResidualMap, ...]
    mean: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]


class _Sealed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    content: msgspec.Raw
    sha256: str


def baseline_path(folder: Path, calibration: str, probe: str) -> Path:
    """Return the path of the baseline of a calibration and a probe, named by their hashes."""
    return folder / f"baseline-{calibration[:16]}-{probe[:16]}.json"


def save_baseline(folder: Path, baseline: Baseline, calibration: str, probe: str) -> Path:
    """Write or replace a baseline; CalibrationError if the folder cannot be written."""
    content = msgspec.json.encode(
        _Content(
            schema=SCHEMA,
            calibration=calibration,
            probe=probe,
            looks=baseline.looks,
            left_px=baseline.left_px,
            maps=baseline.maps,
            mean=tuple(baseline.belief.mean.tolist()),
            covariance=tuple(tuple(row) for row in baseline.belief.covariance.tolist()),
        )
    )
    path = baseline_path(folder, calibration, probe)
    sealed = _Sealed(msgspec.Raw(content), hashlib.sha256(content).hexdigest())
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(path, msgspec.json.encode(sealed))
    except OSError as error:
        raise CalibrationError(
            "baseline.unwritable",
            f"{path}: the baseline cannot be written ({error.strerror}).",
            "Free disk space or give a writable folder, then learn it again.",
        ) from error
    return path


def load_baseline(folder: Path, calibration: str, probe: str) -> Baseline | None:
    """Return a baseline or None; CalibrationError if changed, or of something else."""
    path = baseline_path(folder, calibration, probe)
    if not path.exists():
        return None
    try:
        sealed = msgspec.json.decode(read_bytes(path), type=_Sealed)
        content = msgspec.json.decode(sealed.content, type=_Content)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise _unusable(path, f"cannot be read ({error})") from error
    if hashlib.sha256(sealed.content).hexdigest() != sealed.sha256 or content.schema != SCHEMA:
        raise _unusable(path, "was changed after it was written")
    if (content.calibration, content.probe) != (calibration, probe):
        raise _unusable(path, "belongs to another calibration or another probe")
    if {len(row) for row in content.covariance} != {len(content.mean)}:
        raise _unusable(path, "has no covariance that fits its numbers")
    belief = Belief(np.array(content.mean), np.array([list(row) for row in content.covariance]))
    if belief.covariance.shape != (len(belief.mean),) * 2 or not np.isfinite(belief.mean).all():
        raise _unusable(path, "has no covariance that fits its numbers")
    return Baseline(content.maps, belief, content.left_px, content.looks)


def _unusable(path: Path, how: str) -> CalibrationError:
    return CalibrationError(
        "baseline.unusable",
        f"{path}: this baseline of the sensors {how}.",
        "Delete the file and learn the pattern again.",
    )


class CalibrationMonitor:
    """Examine tracked frames as they arrive; for one thread.

    ``maps``: of the calibration, or empty; replaced by ``baseline``, learnt with this probe.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        maps: Sequence[ResidualMap] = (),
        baseline: Baseline | None = None,
    ) -> None:
        self._rig, self._body = rig, body
        self._belief = baseline.belief if baseline else Belief.of_documents(rig, body)
        known = (
            pattern_maps(rig, baseline.maps, baseline.left_px)
            if baseline
            else pattern_maps(rig, maps, rig.noise.pattern_px)
            if maps
            else ()
        )
        self._collector = ResidualAccumulator(rig, body, LOOK_NS, known)
        self._latest: deque[ResidualSample] = deque(maxlen=LOOKS)
        self._sparse: deque[ResidualSample] = deque(maxlen=LOOKS)
        self._pixels = PixelNoise()
        self._count = 0
        self._good_ns: dict[str, int] = {}
        self._unnamed = 0
        self._unfit = _UnfitFrames(UNFIT_NS)

    def push(self, track: TrackBlock) -> list[DriftReport]:
        """Add tracked frames and return the examinations that became due."""
        results: list[DriftReport] = []
        if self._unfit.push(track):
            results.append(
                DriftReport(
                    time_ns=int(track.time_ns[-1]),
                    cause=ChangeCause.UNKNOWN,
                    cameras=(),
                    what="The spots no longer fit the probe: a camera was pushed hard, or the "
                    "probe is bent or a different one.",
                    good=False,
                    since_ns=self._unfit.last_fit_ns,
                    scores=None,
                )
            )
        for look in self._collector.push(track):
            results += self._add(look)
        return results

    def _add(self, look: ResidualSample) -> list[DriftReport]:
        if self._latest and look.first_ns < self._latest[-1].first_ns:
            # The bus clock was reset: earlier times are invalid.
            self._latest.clear()
            self._sparse.clear()
            self._good_ns.clear()
            self._count = 0
        self._latest.append(look)
        if len(self._latest) > _LAG:
            before = self._latest[-1 - _LAG]
            self._pixels = self._pixels.learnt(before, look, self._rig.noise)
        self._count += 1
        results = []
        # Few looks at one place could share an error not contained in a map.
        if self._count % EVERY == 0 and 2 * len(self._latest) >= LOOKS:
            results.append(self._examined("latest", self._latest))
        if self._count % SPARSE == 0:
            self._sparse.append(look)
            due = self._count % (SPARSE * EVERY) == 0
            if due and 2 * len(self._sparse) >= LOOKS:
                results.append(self._examined("sparse", self._sparse))
        return results

    def _examined(self, kind: str, looks: deque[ResidualSample]) -> DriftReport:
        # Errors above the stated pattern indicate a change.
        pixel_px = min(self._pixels.px, self._rig.noise.pattern_px)
        result = examine(looks, self._rig, self._body, self._belief, pixel_px)
        # Looks from before and after a change fit no hypothesis for a while.
        self._unnamed = self._unnamed + 1 if result.cause is ChangeCause.UNKNOWN else 0
        if 0 < self._unnamed <= LOOKS // EVERY:
            result = replace(result, cause=ChangeCause.NOTHING, what="")
        # A change within some looks may not be visible yet: fault-free until their start.
        if result.good:
            self._good_ns[kind] = looks[0].first_ns
        return replace(result, since_ns=self._good_ns.get(kind))


class _UnfitFrames:
    """Detect a tracked probe that stays visible but no longer fits a pose."""

    def __init__(self, patience_ns: int) -> None:
        self._patience_ns = patience_ns
        self._told = False
        self.last_fit_ns: int | None = None

    def push(self, track: TrackBlock) -> bool:
        """Add frames and return, once, whether it has lasted too long."""
        fit = np.flatnonzero(track.status == FrameStatus.OK)
        lost = np.flatnonzero(track.status == FrameStatus.LOST)
        if len(fit) or len(lost):
            last_fit = int(fit[-1]) if len(fit) else -1
            last_lost = int(lost[-1]) if len(lost) else -1
            # After a loss another probe may appear: that is no shock.
            self.last_fit_ns = int(track.time_ns[last_fit]) if last_fit > last_lost else None
            self._told = False
        if self._told or self.last_fit_ns is None:
            return False
        self._told = int(track.time_ns[-1]) - self.last_fit_ns > self._patience_ns
        return self._told
