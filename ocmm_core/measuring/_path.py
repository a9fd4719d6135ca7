"""Continuous probing: frames of a sliding ball to averages along its path.

While the button is held, frames are averaged as they arrive, in ticks of some milliseconds.
`_path_points` makes points of them at the release.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._point import PathProgress
from ocmm_core.measuring._trigger import FrameCollector
from ocmm_core.tracking import FrameStatus, TrackBlock, cut, in_rig, join, simultaneous

TICK_S = 0.0025
_SHOWN_TICKS = 20
_SHOWN_MM = 0.5
"""Shorter steps of the displayed length are noise."""
LONGEST_S = 120.0
"""A longer path is ended and becomes points, as at the release of the button."""


@dataclass(frozen=True, slots=True)
class Ticks:
    """Averages of some consecutive frames each."""

    time_s: Float
    first_frame: Int
    last_frame: Int
    n_frames: Int
    tip_world: Float
    """(n, 3), mm."""
    covariance: Float
    """(n, 3, 3), mm^2: of the average, due to independent spot noise."""
    rotation_world_from_probe: Float
    """(n, 3, 3): mean of matrices, not orthogonal."""
    spots: Float
    """(n, C, L, 2), px, NaN if not seen throughout."""
    chi2_per_dof: Float
    tip_rig: Float
    reference_spots: Float | None = None

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True, slots=True)
class Path:
    """Frames of one path, averaged."""

    first_frame: int
    ticks: Ticks | None
    """None without a frame with a tip."""
    trail_world: Float
    """(m, 3), mm: ball positions before the button was pressed, oldest first."""
    interrupted: bool = False
    untimed: bool = False
    """Of cameras that do not prove a common exposure time."""


class PathCollector(FrameCollector[Path]):
    """Average the frames between press and release of the probe button."""

    def __init__(self, frame_period_s: float) -> None:
        super().__init__(frame_period_s)
        self._tick_ns = round(max(TICK_S, frame_period_s) * 1e9)
        self._rest: TrackBlock | None = None
        self._ticks: list[Ticks] = []
        self._first = -1
        self._start_ns = 0
        self._key = False
        self._length, self._shown = 0.0, np.full(3, np.nan)

    @property
    def collecting(self) -> bool:
        """Return whether a path is open."""
        return self._first >= 0

    @property
    def progress(self) -> PathProgress | None:
        """Return the state of the open path; None without one."""
        if not self.collecting or not self._ticks:
            return None
        latest = self._ticks[-_SHOWN_TICKS:]
        way = np.concatenate([piece.tip_world for piece in latest])[-_SHOWN_TICKS:]
        time_s = np.concatenate([piece.time_s for piece in latest])[-_SHOWN_TICKS:]
        speed = float(np.linalg.norm(way[-1] - way[0])) / max(time_s[-1] - time_s[0], 1e-9)
        return PathProgress(self._length, speed)

    def arm(self) -> None:
        """Start a path with the next frame, as if the button was held; the next call ends it."""
        self._key = not self.collecting

    def _interrupt(self, block: TrackBlock, first: int) -> list[Path]:
        self._key = False
        return [replace(self._end(), interrupted=True)] if self.collecting else []

    def _push(self, block: TrackBlock) -> list[Path]:
        paths: list[Path] = []
        down = ((block.flags & FrameFlag.BUTTON) != 0) | self._key
        start = 0
        while start < len(block):
            if self.collecting:
                stop = _first_of(~down, start)
                self._average(cut(block, start, stop))
                over = int(block.time_ns[stop - 1]) - self._start_ns > LONGEST_S * 1e9
                if stop < len(block) or over:
                    paths.append(self._end())
            else:
                stop = _first_of(down & ~np.append(self._button, down[:-1]), start)
                self._trail.follow(block, start, stop)
                if stop < len(block):
                    self._first, self._start_ns = int(block.counter[stop]), int(block.time_ns[stop])
            self._button = bool(down[stop - 1]) if stop else self._button
            start = stop
        return paths

    def _average(self, block: TrackBlock) -> None:
        """Average complete ticks and keep the remaining frames."""
        if self._rest is not None:
            block = join([self._rest, block])
        if len(block):
            number = (block.time_ns - self._start_ns) // self._tick_ns
            full = int(np.searchsorted(number, number[-1]))
            self._ticks += ticks_of(cut(block, 0, full), number[:full])
            if self._ticks:
                step = float(np.linalg.norm(self._ticks[-1].tip_world[-1] - self._shown))
                if not step < _SHOWN_MM:
                    self._length += step if np.isfinite(step) else 0.0
                    self._shown = self._ticks[-1].tip_world[-1]
            self._rest = cut(block, full, len(block))

    def _end(self) -> Path:
        if self._rest is not None:
            self._ticks += ticks_of(self._rest, np.zeros(len(self._rest), dtype=np.int64))
        path = Path(self._first, _joined(self._ticks), self._trail.places)
        self._rest, self._ticks, self._first, self._key = None, [], -1, False
        self._length, self._shown = 0.0, np.full(3, np.nan)
        self._trail.clear()
        return path


def _first_of(marks: NDArray[np.bool_], start: int) -> int:
    """Return the first marked index from ``start`` on, or the end."""
    found = np.flatnonzero(marks[start:])
    return start + int(found[0]) if len(found) else len(marks)


def ticks_of(block: TrackBlock, number: Int) -> list[Ticks]:
    """Return the averages of good frames with the same number, (n,), ascending; maybe none."""
    block = simultaneous(block)
    good = np.flatnonzero(block.status == FrameStatus.OK)
    if not len(good):
        return []
    starts = np.flatnonzero(np.diff(number[good], prepend=-1))
    counts = np.diff(np.append(starts, len(good)))

    def mean(values: NDArray[np.floating[Any]]) -> Float:
        totals = np.add.reduceat(values[good], starts)
        return np.asarray(totals / counts.reshape(-1, *[1] * (totals.ndim - 1)))

    last = starts + counts - 1
    reference = block.reference
    return [
        Ticks(
            time_s=mean(block.time_ns * 1e-9),
            first_frame=block.counter[good][starts],
            last_frame=block.counter[good][last],
            n_frames=counts,
            tip_world=mean(block.tip_world),
            covariance=mean(block.tip_covariance) / counts[:, None, None],
            rotation_world_from_probe=mean(block.rotation_world_from_probe),
            spots=mean(block.uv),
            chi2_per_dof=mean(block.chi2 / np.maximum(block.dof, 1)),
            tip_rig=mean(in_rig(block).tip_world),
            reference_spots=None if reference is None else mean(reference.body.uv),
        )
    ]


def _joined(pieces: list[Ticks]) -> Ticks | None:
    if not pieces:
        return None
    names = [item.name for item in fields(Ticks)]
    columns = {name: [getattr(piece, name) for piece in pieces] for name in names}
    return Ticks(
        **{k: None if v[0] is None else np.concatenate(v) for k, v in columns.items()}  # type: ignore[arg-type] # by its fields
    )
