"""Averaged spots of a waved probe and of a bar at rest, from recordings and tables of shots."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ocmm_boards._joint import RecordedSpots
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.acquisition.recording import Recording
from ocmm_core.calibration import guided
from ocmm_core.calibration.guided import Shot
from ocmm_core.calibration.probe_design import UNMEASURED_K, Temperature
from ocmm_core.calibration.records import LengthBar
from ocmm_core.calibration.relocation import bar_ends, observations_of
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

_APART_MM, _TURN_RAD = 15.0, 0.08
"""Between two poses of a waved probe."""
_BATCH = 64


@dataclass(frozen=True, slots=True)
class Recordings:
    """Recordings that belong to the pictures of a board."""

    body: ProbeBody
    bar: LengthBar | None = None
    sweep: Path | None = None
    """Raw frames of the waved probe."""
    placements: Path | None = None
    """Raw frames of the bar, which rests at several places."""
    shots: tuple[Shot, ...] = ()
    """Averaged spots."""

    def spots(self, located: Rig, temperature: Temperature | None) -> RecordedSpots:
        """Return the spots, labelled by the cameras of ``located``.

        AcquisitionError: a file is not a recording, or damaged. InputError: of other cameras.
        CalibrationError: nothing usable in it, or no bar with LEDs for its placements.
        """
        shots = list(self.shots)
        if self.sweep is not None:
            shots += _found(self.sweep, located, self._of_sweep, "the waved probe")
        if self.placements is not None:
            shots += _found(self.placements, located, self._of_placements, "the resting bar")
        views = len(located.cameras), self.body.n_leds
        observed = observations_of(shots, views, self.bar, temperature)
        uses = () if self.bar is None or not observed.bars else (self.bar.artefact.use,)
        sigma_k = UNMEASURED_K if temperature is None else temperature.sigma_k
        return RecordedSpots(self.body, observed, sigma_k, uses)

    def _of_sweep(self, rig: Rig, blocks: Iterator[FrameBlock]) -> Iterator[Shot]:
        averager = guided.ProbeSpotAverager(
            rig, self.body, guided.waved_frames(rig), resting=False, distance_mm=_APART_MM,
            turn_rad=_TURN_RAD, moved=True,
        )  # fmt: skip
        for average in _averages(averager, blocks):
            yield Shot("pose", "", average.uv, average.sigma_px)

    def _of_placements(self, rig: Rig, blocks: Iterator[FrameBlock]) -> Iterator[Shot]:
        places = () if self.bar is None else self.bar.leds
        if not places:
            raise CalibrationError(
                "boards.bar",
                "A recording of a bar needs the document of a bar with an LED at each end.",
                "Give it with --bar, or touch the ends of the bar: a table of shots.",
            )
        for average in _averages(guided.StaticSpotAverager(rig, 2), blocks):
            uv = bar_ends(rig, average.uv, places[1] - places[0])
            yield Shot("bar", "", uv, average.sigma_px)


def _averages(
    averager: guided.ProbeSpotAverager | guided.StaticSpotAverager, blocks: Iterator[FrameBlock]
) -> Iterator[guided.Average]:
    for block in blocks:
        averager.push(block)
        if averager.live().ready:
            average = averager.average()
            averager.taken(average)
            yield average


def _found(
    path: Path, rig: Rig, shots_in: Callable[[Rig, Iterator[FrameBlock]], Iterator[Shot]], of: str
) -> Sequence[Shot]:
    with Recording(path) as recording:
        recording.check_rig(rig)
        shots = tuple(shots_in(rig, _blocks(recording)))
    if not shots:
        raise CalibrationError(
            "boards.recording",
            f"{path}: the recording shows nowhere {of} to two cameras.",
            "Check that it is the right recording, probe or bar, and that no other lights are in "
            "the view.",
        )
    return shots


def _blocks(recording: Recording) -> Iterator[FrameBlock]:
    start = 0
    while start < len(recording):
        block = recording.read(start, _BATCH)
        start += len(block)
        yield block
