"""A learnt baseline on the disk: read back unchanged, or refused with a reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.monitor import Baseline, load_baseline, save_baseline
from ocmm_core.calibration.monitor._monitor import baseline_path
from ocmm_core.calibration.monitor._residual_samples import Belief
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.errors import CalibrationError

CALIBRATION, PROBE = "c" * 64, "d" * 64


def made() -> Baseline:
    rng = np.random.default_rng(3)
    maps = tuple(
        ResidualMap(
            columns=4,
            rows=3,
            mean_u_px=tuple(rng.standard_normal(12).tolist()),
            mean_v_px=tuple(rng.standard_normal(12).tolist()),
            count=tuple(range(12)),
        )
        for _ in range(2)
    )
    square = rng.standard_normal((49, 49))
    return Baseline(maps, Belief(rng.standard_normal(49), square @ square.T), 0.0014, 6000)


def test_a_baseline_comes_back_bit_for_bit(tmp_path: Path) -> None:
    assert load_baseline(tmp_path, CALIBRATION, PROBE) is None
    baseline = made()
    save_baseline(tmp_path / "new", baseline, CALIBRATION, PROBE)
    again = load_baseline(tmp_path / "new", CALIBRATION, PROBE)
    assert again is not None
    assert (again.maps, again.left_px, again.looks) == (baseline.maps, 0.0014, 6000)
    assert np.array_equal(again.belief.mean, baseline.belief.mean)
    assert np.array_equal(again.belief.covariance, baseline.belief.covariance)
    assert load_baseline(tmp_path / "new", CALIBRATION, "e" * 64) is None


def test_every_changed_byte_is_noticed(tmp_path: Path) -> None:
    path = save_baseline(tmp_path, made(), CALIBRATION, PROBE)
    content = path.read_bytes()
    rng = np.random.default_rng(1)
    for at in rng.integers(0, len(content), 200):
        changed = bytearray(content)
        changed[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(changed))
        with pytest.raises(CalibrationError) as caught:
            load_baseline(tmp_path, CALIBRATION, PROBE)
        assert str(path) in caught.value.what
        assert caught.value.code == "baseline.unusable"


def test_a_baseline_under_another_name_is_refused(tmp_path: Path) -> None:
    path = save_baseline(tmp_path, made(), CALIBRATION, PROBE)
    other = "f" * 64
    path.rename(baseline_path(tmp_path, other, PROBE))
    with pytest.raises(CalibrationError, match="another calibration"):
        load_baseline(tmp_path, other, PROBE)
