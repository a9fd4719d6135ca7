"""Tips from poses that other programs recorded: by `ocmm probe pivot` and its function."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.geometry import Float
from ocmm_core.tables import TableOptions
from ocmm_trackers import pivot_of_files, read_poses
from tests.commands import Ocmm

TIP = np.array([-17.8, 1.1, -156.9])
NAMES = "x,y,z,qx,qy,qz,qw"
PUBLISHED = np.array([-17.7799, 1.1113, -156.865])


def recorded(rng: np.random.Generator, count: int = 120, off: float = 0.0) -> Float:
    """Return rows x y z qx qy qz qw of a tool about a place; ``off``: error of the recording."""
    turns = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, (count, 3)))
    centre = np.array([150.0, -60.0, -1040.0]) + rng.uniform(-50.0, 50.0, 3)
    origins = centre - turns.apply(TIP + off * rng.standard_normal(3))
    origins += 0.1 * rng.standard_normal(origins.shape)
    return np.hstack([origins, turns.as_quat()])


def written(path: Path, rows: Float, heading: str = NAMES, sign: str = ",") -> Path:
    lines = [sign.join(f"{value:.9f}" for value in row) for row in rows]
    path.write_text("\n".join([heading.replace(",", sign), *lines]) + "\n")
    return path


def test_the_published_tip_by_the_command(reference: Path, ocmm_here: Ocmm) -> None:
    file = reference / "pivot" / "pivotCalibrationData.txt"
    done = ocmm_here("probe", "pivot", file, "--columns", NAMES, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    # Published to six digits.
    assert np.linalg.norm(found["tip"] - PUBLISHED) < 1e-3
    assert found["U"] is None
    shown = ocmm_here("probe", "pivot", file, "--columns", NAMES)
    assert "-156.865" in shown.stdout
    assert "No U" in shown.stdout
    assert ocmm_here("probe", "pivot", file).returncode == 2


@pytest.mark.parametrize(
    ("heading", "order", "size", "sign"),
    [
        (NAMES, (0, 1, 2, 3, 4, 5, 6), 1.0, " "),
        ("q0,Qx,Qy,Qz,Tx,Ty,Tz", (6, 3, 4, 5, 0, 1, 2), 1.0, ","),
        ("Tx [m],Ty [m],Tz [m],qx,qy,qz,qw", (0, 1, 2, 3, 4, 5, 6), 1e3, ";"),
        ("X,Y,Z,QX,QY,QZ,QS", (0, 1, 2, 3, 4, 5, 6), 1.0, "\t"),
    ],
)  # fmt: skip
def test_headings_of_other_programs(
    tmp_path: Path, heading: str, order: tuple[int, ...], size: float, sign: str
) -> None:
    rows = recorded(np.random.default_rng(3))
    places = rows / np.array([size] * 3 + [1.0] * 4)
    file = written(tmp_path / "poses.csv", places[:, order], heading, sign)
    (pivot,) = pivot_of_files([read_poses(file)]).pivots
    # 120 poses of 0.1 mm know the tip to 0.02 mm.
    assert np.abs(pivot.tip - TIP).max() < 0.15


def test_hidden_tools_are_counted(tmp_path: Path) -> None:
    file = written(tmp_path / "poses.csv", recorded(np.random.default_rng(4)))
    file.write_text(file.read_text() + ",,,,,,\n" + "," * 6 + "\n1,2,3,0,0,0,1\n")
    read = read_poses(file)
    assert len(read.rotations) == 121
    found = pivot_of_files([read]).pivots[0]
    assert not found.used[-1]
    assert np.abs(found.tip - TIP).max() < 0.15


MIXED: dict[str, Callable[[Float], Float]] = {
    "first for last": lambda q: np.roll(q, 1, axis=1),
    "last for first": lambda q: np.roll(q, -1, axis=1),
    "inverse": lambda q: q * np.array([-1.0, -1.0, -1.0, 1.0]),
}


@pytest.mark.parametrize("name", MIXED)
def test_mixed_quaternions_are_named(
    tmp_path: Path, name: str, repeats: Callable[..., int]
) -> None:
    for seed in range(repeats(10, 100)):
        rows = recorded(np.random.default_rng(seed))
        rows[:, 3:] = MIXED[name](rows[:, 3:])
        file = read_poses(written(tmp_path / "poses.csv", rows))
        with pytest.raises(CalibrationError, match=r"agree to 0\.1"):
            pivot_of_files([file])


def test_what_has_no_meaning_is_refused(tmp_path: Path) -> None:
    rows = recorded(np.random.default_rng(5))
    for heading in ("x,y,z,q1,q2,q3,q4", "x,y,z,roll,pitch,yaw,-", "x,y,z,qx,qy,qz,q"):
        with pytest.raises(InputError, match="columns"):
            read_poses(written(tmp_path / "poses.csv", rows, heading))
    long = rows * np.array([1.0] * 6 + [1.01])
    with pytest.raises(InputError, match="line 2: the quaternion has the length"):
        read_poses(written(tmp_path / "poses.csv", long))
    with pytest.raises(InputError, match="furlong"):
        read_poses(written(tmp_path / "poses.csv", rows), TableOptions(unit="furlong"))
    still = np.tile(rows[:1], (50, 1))
    with pytest.raises(CalibrationError, match="do not determine"):
        pivot_of_files([read_poses(written(tmp_path / "poses.csv", still))])


def test_u_holds_what_recordings_differ_by(tmp_path: Path, repeats: Callable[..., int]) -> None:
    rng, inside, n = np.random.default_rng(6), 0, repeats(40, 400)
    for _ in range(n):
        files = [
            read_poses(written(tmp_path / f"{place}.csv", recorded(rng, 40, 0.3)))
            for place in range(4)
        ]
        found = pivot_of_files(files)
        assert found.expanded is not None
        inside += int(np.count_nonzero(np.abs(found.tip - TIP) <= found.expanded))
    share, sigma = inside / (3 * n), np.sqrt(0.9545 * 0.0455 / (3 * n))
    assert abs(share - 0.9545) < 4.0 * sigma
