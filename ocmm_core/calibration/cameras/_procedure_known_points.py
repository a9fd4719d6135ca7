"""Guided calibration: averaged spots at each position of a CMM's list, live or from a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import TypeAlias

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.cameras._model_fit import MINIMUM_POINTS
from ocmm_core.calibration.cameras._network import found_by
from ocmm_core.calibration.cameras._reference_points import KnownPoints, SpotTable
from ocmm_core.calibration.records import ArtefactUse, rig_from_record
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError

EVALUATION_FROM = 80
"""Minimum list length for keeping a part for evaluation."""

PREPARE, COLLECT, RESULT = "prepare", "collect", "result"


class KnownPointsBegun(guided.SessionHeader, frozen=True, kw_only=True):
    """First line."""

    names: tuple[str, ...]
    positions: tuple[tuple[float, float, float], ...]
    reference_sigma: float
    frame: str
    length_sigma: float
    """`names`, `positions`, `reference_sigma`, `frame`, `length_sigma`: As `KnownPoints`; mm."""
    evaluation: int
    valid_days: int
    artefacts: tuple[ArtefactUse, ...]
    """The CMM that positioned the points, with its certificate."""


class ReferencePointEvent(guided.SessionEvent, frozen=True, kw_only=True, tag="PointTaken"):
    """Spots at one reference point; replaces an earlier event of it."""

    point: str
    uv: guided.Spots
    """(C, 1), px; all None for a skipped point."""
    sigma_px: float


KnownPointsEvent: TypeAlias = KnownPointsBegun | ReferencePointEvent


def views_of(taken: ReferencePointEvent) -> int:
    """Return the number of cameras that saw a point."""
    return sum(camera[0] is not None for camera in taken.uv)


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownPointsSetup(guided.SessionSetup):
    points: KnownPoints
    evaluation: int | None = None
    """Points held back; None: a quarter of a long list."""
    valid_days: int = 365
    artefacts: tuple[ArtefactUse, ...] = ()
    """As `KnownPointsBegun`."""


class KnownPointsProcedure(
    guided.CameraProcedure[
        KnownPointsEvent, guided.CalibrationOutcome, KnownPointsBegun, KnownPointsSetup
    ]
):
    """See `procedure`."""

    kind = guided.ProcedureKind.KNOWN_POINTS
    sessions = guided.SessionFormat(kind, guided.SessionLine[KnownPointsEvent], KnownPointsBegun)
    step_names = (PREPARE, COLLECT, RESULT)

    def __init__(
        self,
        site: guided.SessionSite,
        chain: ChainFile[guided.SessionLine[KnownPointsEvent]],
        begun: KnownPointsBegun,
    ) -> None:
        super().__init__(site, chain, begun)
        self._points = KnownPoints(
            begun.names, np.array(begun.positions), begun.reference_sigma, begun.frame,
            begun.length_sigma,
        )  # fmt: skip
        self._taken: list[ReferencePointEvent] = []
        self._spots = guided.StaticSpotAverager(site.rig, 1)
        self._aim: str | None = None
        self._fold()

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: KnownPointsSetup, now: datetime
    ) -> dict[str, object]:
        points, evaluation = setup.points, setup.evaluation
        count = len(points.names)
        if evaluation is None:
            evaluation = count // 4 if count >= EVALUATION_FROM else 0
        if not 0 <= evaluation < count:
            raise CalibrationError(
                "calibration.split",
                f"{evaluation} of {count} points for evaluation leave none for the calibration.",
                "Keep fewer points for evaluation.",
            )
        return {
            "names": points.names,
            "positions": tuple((x, y, z) for x, y, z in points.positions_world.tolist()),
            "reference_sigma": points.sigma, "frame": points.frame,
            "length_sigma": points.length_sigma, "evaluation": evaluation,
            "valid_days": setup.valid_days, "artefacts": setup.artefacts,
        }  # fmt: skip

    @property
    def points(self) -> KnownPoints:
        return self._points

    @property
    def view(self) -> guided.KnownPointsView:
        with self._lock:
            views = {one.point: views_of(one) for one in self._taken}
            points = tuple(
                guided.KnownPoint(name, position, views.get(name))
                for name, position in zip(
                    self._points.names, self._points.positions_world, strict=True
                )
            )
            return guided.KnownPointsView(self.base, points, self._next(), self._outcome)

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            self._spots.push(block)

    def aim(self, point: str | None) -> None:
        """Choose the next point, None: first unrecorded; CalibrationError if not listed."""
        if point is not None and point not in self._points.names:
            raise CalibrationError(
                "known_points.unknown",
                f"The point {point!r} is not in the list of reference points.",
                "Choose a point of the list.",
            )
        with self._lock:
            self._aim = point

    def skip(self, now: datetime) -> None:
        """Skip the next point because no camera can see it."""
        with self._lock:
            index = self._next()
            if index is not None:
                nothing: guided.Spots = ((None,),) * len(self.rig.cameras)
                utc, name = guided.utc_text(now), self._points.names[index]
                self._append(ReferencePointEvent(utc=utc, point=name, uv=nothing, sigma_px=0.0))

    def take_table(self, spots: SpotTable, now: datetime) -> None:
        """Record all unrecorded points of a table; CalibrationError if it has other cameras."""
        serials = tuple(camera.serial for camera in self.rig.cameras)
        if set(spots.serials) != set(serials):
            raise CalibrationError(
                "calibration.serial_mismatch",
                f"The spots are from cameras {_listed(spots.serials)}, but rig "
                f"'{self.rig.name}' has {_listed(serials)}.",
                "Select the rig the spots were taken with.",
            )
        rows = [spots.serials.index(serial) for serial in serials]
        with self._lock:
            done = {one.point for one in self._taken}
            for index, name in enumerate(self._points.names):
                if name not in done:
                    uv = guided.to_spots(spots.uv[rows, index][:, None])
                    self._append(
                        ReferencePointEvent(
                            utc=guided.utc_text(now), point=name, uv=uv, sigma_px=spots.sigma_px
                        )
                    )

    def table(self) -> SpotTable:
        """Return the spots of all points in the order of the list; NaN if not recorded."""
        with self._lock:
            taken = {one.point: one for one in self._taken}
        uv = np.full((len(self.rig.cameras), len(self._points.names), 2), np.nan)
        sigmas = []
        for index, name in enumerate(self._points.names):
            if name in taken and views_of(taken[name]):
                uv[:, index] = guided.from_spots(taken[name].uv)[:, 0]
                sigmas.append(taken[name].sigma_px)
        sigma = float(np.sqrt(np.mean(np.square(sigmas)))) if sigmas else 1.0
        return SpotTable(tuple(camera.serial for camera in self.rig.cameras), uv, sigma)

    def _next(self) -> int | None:
        if self._aim is not None:
            return self._points.names.index(self._aim)
        done = {one.point for one in self._taken}
        return next((i for i, name in enumerate(self._points.names) if name not in done), None)

    def _seen(self) -> guided.Live:
        return self._spots.live()

    def _wants(self) -> bool:
        return self._step == COLLECT and self._next() is not None

    def _observation(self, utc: str) -> ReferencePointEvent:
        index = self._next()
        assert index is not None  # noqa: S101 - a point is wanted
        average = self._spots.average()
        spots, name = guided.to_spots(average.uv), self._points.names[index]
        return ReferencePointEvent(utc=utc, point=name, uv=spots, sigma_px=average.sigma_px)

    def _observe(self, event: KnownPointsEvent) -> None:
        if isinstance(event, ReferencePointEvent):
            self._taken.append(event)
            self._aim = None
            self._spots.taken(guided.Average(guided.from_spots(event.uv), event.sigma_px))

    def _has_observation(self, step: str) -> bool:
        return step == COLLECT and bool(self._taken)

    def _undo(self, step: str) -> None:
        self._taken.pop()

    def _steps(self) -> tuple[guided.Step, ...]:
        done = len({one.point for one in self._taken})
        count = len(self._points.names)
        index = self._next()
        where = "All points taken."
        if index is not None:
            x, y, z = self._points.positions_world[index]
            name = self._points.names[index]
            where = (
                f"Move the target to {name}: x {x:z.1f}, y {y:z.1f}, z {z:z.1f} mm in the world "
                "frame."
            )
        return (
            guided.Step(
                PREPARE,
                "Prepare",
                "Fix one bright target to the machine that positions it, let cameras and machine "
                "warm up, and cover other lights.",
                guided.OPEN,
            ),
            guided.Step(COLLECT, "Known points", where, self._collected(done), done, count),
            guided.Step(
                RESULT,
                "Result",
                "Review the residuals and the changes, then accept the new calibration or keep "
                "the old one.",
                guided.LAST_OF_CALIBRATION,
            ),
        )

    def _collected(self, done: int) -> guided.Gate:
        count = len(self._points.names)
        if done < count:
            return guided.Gate(
                False,
                f"{count - done} of {count} points {'is' if count - done == 1 else 'are'} missing.",
                "Take them, or skip those no camera sees.",
            )
        uv = self.table().uv
        for camera, of_camera in zip(self.rig.cameras, uv, strict=True):
            seen = int(np.count_nonzero(np.isfinite(of_camera[:, 0])))
            if seen < MINIMUM_POINTS:
                return guided.Gate(
                    False,
                    f"Camera '{camera.name}' saw only {seen} of the points.",
                    f"Use a list of which every camera sees at least {MINIMUM_POINTS}.",
                )
        return guided.OPEN

    def _calculation(self) -> Callable[[], guided.CalibrationOutcome]:
        table, force, running = self.table(), self._forced, self._store.active()
        made = self._taken[-1].utc if self._taken else self._begun.utc
        rig, points, begun, sensors_c = self.rig, self._points, self._begun, self._sensors_c
        before = None if running is None else rig_from_record(running)

        def calculate() -> guided.CalibrationOutcome:
            found = found_by(rig, points, table, begun.evaluation, force)
            how = guided.CalibrationContext(
                method="known points", made=datetime.fromisoformat(made),
                valid_days=begun.valid_days, who=begun.who, software=begun.software,
                temperature_c=begun.temperature_c, sensor_temperatures_c=sensors_c,
                data_sha256=guided.hash_of(points.positions_world, table.uv),
                artefacts=begun.artefacts, previous=begun.running,
            )  # fmt: skip
            return guided.build_outcome(rig, found, how, before)

        return calculate

    def _put(self, outcome: guided.CalibrationOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.accept(outcome.record, self._begun.who, decided.reason, now, self._log.path)


def _listed(serials: tuple[int, ...]) -> str:
    return ", ".join(map(str, serials))
