"""File of a learnt baseline, stored with its calibration, for one probe."""

from __future__ import annotations

import hashlib
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.calibration.monitor._baseline import Baseline
from ocmm_core.calibration.monitor._drift_design_matrix import Belief
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import CalibrationError

SCHEMA = "ocmm.sensor-baseline/1"


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
