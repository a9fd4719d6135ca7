"""Work of the campaign: small writes of the product, each acknowledged."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder, ReplaySource
from ocmm_core.camera import load_rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import resource, write_atomic
from ocmm_core.errors import OcmmError
from ocmm_core.export import write_together
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, make_head

_LINES = 3
_FRAMES = 40

Acknowledge = Callable[[int], object]


@dataclass(frozen=True, slots=True)
class CampaignWork:
    """A kind of writing."""

    do: Callable[[Path, Acknowledge], None]
    """Writes into a folder, and acknowledges each number when it is durable."""
    lost: Callable[[Path, list[int]], int]
    """Counts acknowledged numbers missing in that folder; OcmmError if it is unusable."""


class CampaignLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A record of the campaign's history."""

    number: int


def sample_point(number: int) -> MeasuredPoint:
    """Return a point whose values follow from its number."""
    rng = np.random.default_rng(number)
    return MeasuredPoint(
        number=number,
        feature="BORE",
        time_s=float(number),
        first_frame=800 * number,
        last_frame=800 * number + 399,
        n_frames=400,
        tip_world=rng.normal(0.0, 300.0, 3),
        random_covariance=1e-6 * np.eye(3),
        direction=np.array([0.0, 0.0, 1.0]),
        tip_radius=1.5,
        rotation_world_from_probe=np.eye(3),
        spots=rng.normal(1000.0, 300.0, (2, 5, 2)),
        chi2_per_dof=1.0,
        approach="trail",
    )


def sample_job(path: Path) -> JobFile:
    path.parent.mkdir(parents=True, exist_ok=True)
    plan = resource("plans", "quick.toml")
    rig, probe = resource("rigs", "recommended.toml"), resource("probes", "standard.toml")
    head = make_head(plan=plan, rig=rig, probe=probe, operator="me", part="P", serial="1")
    return JobFile.create(path, head)


def append_points(path: Path, acknowledge: Acknowledge, most: int) -> None:
    """Append points to a job, creating it if missing."""
    with JobFile.open(path) if path.exists() else sample_job(path) as job:
        first = job.next_number()
        for number in range(first, first + most):
            job.append_point(sample_point(number))
            acknowledge(number)


def lost_points(path: Path, acknowledged: list[int]) -> int:
    """Return the number of acknowledged points that are missing or changed in the job."""
    if not path.exists():
        return len(acknowledged)
    with JobFile.open(path) as job:
        found = {point.number: point.spots.tobytes() for point in job.points()}
        faults = job.verify()
    wrong = sum(found.get(at) != sample_point(at).spots.tobytes() for at in acknowledged)
    # Audit findings are faults of the file, even if all points exist.
    return wrong + len(faults)


def _job(folder: Path, acknowledge: Acknowledge) -> None:
    append_points(folder / "a.ocmm", acknowledge, _LINES)


def _lost_in_job(folder: Path, acknowledged: list[int]) -> int:
    path = folder / "a.ocmm"
    return lost_points(path, acknowledged) if acknowledged or path.exists() else 0


def _history(folder: Path, acknowledge: Acknowledge) -> None:
    chain = ChainFile(folder / "store" / "events.jsonl", CampaignLine)
    for number in range(1, _LINES + 1):
        chain.append(CampaignLine(number))
        acknowledge(number)


def _lost_in_history(folder: Path, acknowledged: list[int]) -> int:
    chain = ChainFile(folder / "store" / "events.jsonl", CampaignLine)
    return len(set(acknowledged) - {line.number for line in chain.items})


def _report(folder: Path, acknowledge: Acknowledge) -> None:
    for number in (1, 2):
        write_together(
            {folder / f"{name}.csv": f"{number}\n".encode() for name in ("job", "points", "cloud")}
        )
        acknowledge(number)


def _lost_in_report(folder: Path, acknowledged: list[int]) -> int:
    files = [folder / f"{name}.csv" for name in ("job", "points", "cloud")]
    numbers = {int(path.read_text()) if path.exists() else 0 for path in files}
    # All of one report: the last acknowledged one or the one after it.
    return int(len(numbers) != 1 or not 0 <= max(numbers) - max([0, *acknowledged]) <= 1)


def _settings(folder: Path, acknowledge: Acknowledge) -> None:
    for number in (1, 2):
        write_atomic(folder / "settings.json", b"%d" % number)
        acknowledge(number)


def _lost_in_settings(folder: Path, acknowledged: list[int]) -> int:
    path = folder / "settings.json"
    number = int(path.read_bytes()) if path.exists() else 0
    return int(not 0 <= number - max([0, *acknowledged]) <= 1)


def _recording(folder: Path, acknowledge: Acknowledge) -> None:
    rig = load_rig(resource("rigs", "recommended.toml"))
    serials = tuple(camera.serial for camera in rig.cameras)
    description = SourceDescription("campaign", serials, 125_000, 1_000_000, False, True)
    with FrameRecorder(folder / "a.ocmr", description, rig) as recorder:
        for number in range(1, _LINES + 1):
            recorder.append(_block(number, len(serials)))
            acknowledge(number)


def _lost_in_recording(folder: Path, acknowledged: list[int]) -> int:
    if not acknowledged:
        return 0
    source = ReplaySource(folder / "a.ocmr")
    try:
        frames = len(source.recording)
    finally:
        source.close()
    return max(0, len(acknowledged) - frames // _FRAMES)


def _block(number: int, cameras: int) -> FrameBlock:
    counter = np.arange(_FRAMES, dtype=np.int64) + _FRAMES * number
    return FrameBlock(
        counter=counter,
        time_ns=counter * 125_000,
        flags=np.zeros(_FRAMES, dtype=np.uint32),
        valid=np.full((_FRAMES, cameras), 0xFF, dtype=np.uint64),
        uv=np.full((_FRAMES, cameras, 8, 2), float(number)),
    )


WORKS = {
    "job": CampaignWork(_job, _lost_in_job),
    "history": CampaignWork(_history, _lost_in_history),
    "report": CampaignWork(_report, _lost_in_report),
    "recording": CampaignWork(_recording, _lost_in_recording),
    "settings": CampaignWork(_settings, _lost_in_settings),
}
"""Kinds by name in the table."""


def outcome_of(work: CampaignWork, folder: Path, pipe: int) -> str:
    """Do the work, write its acknowledgements to a pipe, and return how it ended."""
    try:
        work.do(folder, lambda number: os.write(pipe, b"%d\n" % number))
    except OcmmError:
        return "told"
    except OSError:
        # Callers that write settings turn it into their own message.
        return "told" if work is WORKS["settings"] else "traceback"
    except Exception:
        return "traceback"
    return "done"
