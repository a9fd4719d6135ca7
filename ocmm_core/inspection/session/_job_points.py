"""Points of a job: valid, deleted, and held ones, all with the same reference body or none.

Nothing in a job file is changed or removed: a row annuls a point, a new row with a new number
repeats its observation, and the event names the old one.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core import tracking
from ocmm_core.camera import Rig
from ocmm_core.documents import shortened
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import DeletedPoint, HoldReason, event_text, held_back
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobReference, bad_event


class ReferenceUse:
    """Keep a job with its initial reference body.

    MeasuringError if its points are relative to another reference body, or none, or if the cameras
    were recalibrated since.
    """

    def __init__(
        self,
        rig: Rig,
        body: tracking.ProbeBody,
        reference: tracking.ReferenceBody | None,
        job: JobFile,
        *,
        begun: bool,
    ) -> None:
        self.home: tracking.ReferenceHome | None = None
        """Pose of the reference body at the start of the job; None if not yet known."""
        self._rig, self._body, self._reference = rig, body, reference
        self._job = job
        stored = job.reference()
        if stored is not None and (reference is None or reference.identity != stored.identity):
            raise MeasuringError(
                "session.other_reference",
                f"{job.path}: the points of this job are relative to a reference body, and it is "
                + ("not given now." if reference is None else f"not '{reference.name}'."),
                "Choose the reference body the job was started with (Settings, Instrument), fixed "
                "as it was then; or start a new job.",
            )
        if stored is None and reference is not None and begun:
            raise MeasuringError(
                "session.no_reference",
                f"{job.path}: this job was measured without a reference body.",
                "Continue without a reference body (Settings, Instrument), or start a new job.",
            )
        if stored is not None and job.head.rig_identity != rig.identity:
            raise MeasuringError(
                "session.other_cameras",
                f"{job.path}: the cameras were recalibrated after this job was started; the "
                "position of the reference body at that time is unknown to the new calibration.",
                "Start a new job.",
            )
        if stored is not None and reference is not None:
            self.home = tracking.home_of(stored.spots, stored.n_frames, rig, reference)

    def keep(self, home: tracking.ReferenceHome) -> None:
        """Make the first pose of the body durable, once; StorageError: no point may be recorded."""
        if self.home is None and self._reference is not None:
            self._job.store_reference(JobReference(self._reference.text, home.spots, home.n_frames))
            self.home = home

    def sensitivity(self, spots: Float, reference_spots: Float | None) -> tracking.TipSensitivity:
        """Return the tip of mean spots (C, L, 2) and (C, R, 2), px, with its derivatives.

        TrackingError if no pose; MeasuringError if not relative to the reference body of the job.
        """
        return self.sensitivities([(spots, reference_spots)])[0]

    def sensitivities(
        self, observed: Sequence[tuple[Float, Float | None]]
    ) -> tuple[tracking.TipSensitivity, ...]:
        """Do the same as `sensitivity` for many points at once."""
        if not observed:
            return ()
        spots = _stacked([seen for seen, _ in observed])
        beside = [seen for _, seen in observed if seen is not None]
        if self._reference is None and not beside:
            return tracking.tip_sensitivities(spots, self._rig, self._body)
        if self._reference is None or self.home is None or len(beside) != len(observed):
            raise MeasuringError(
                "session.reference_home",
                "The position of the reference body at the start of the job is unknown.",
                "Let part and cameras come to rest until the machine is ready, then touch again.",
            )
        return tracking.relative_sensitivities(
            spots, _stacked(beside), self.home, self._rig, self._body, self._reference
        )

    def thesis_tip(self, spots: Float, reference_spots: Float | None) -> Float:
        """Return the tip (3,), mm, by the thesis; NaN without pose or the job's reference body."""
        if (self._reference is None) != (reference_spots is None):
            return np.full(3, np.nan)
        pose = self._thesis(spots, self._body.leds_probe, self._body.tip_probe)
        tip: Float = pose.tip_world[0]
        if self._reference is None or reference_spots is None:
            return tip
        if self.home is None:
            return np.full(3, np.nan)
        now = self._thesis(reference_spots, self._reference.leds.leds_body, np.zeros(3))
        turn, shift = tracking.motion_to_world(
            self.home, now.rotation_world_from_probe, now.origin_world
        )
        tip_world: Float = turn[0] @ tip + shift[0]
        return tip_world

    def _thesis(self, spots: Float, leds: Float, point: Float) -> tracking.PoseBatch:
        sigma_px = tracking.spot_sigma_px(self._rig)
        return tracking.solve_leds(spots[None], self._rig, leds, point, sigma_px, "thesis")


def _stacked(spots: Sequence[Float]) -> Float:
    shapes = sorted({one.shape for one in spots})
    if len(shapes) > 1:
        words = " and of ".join(" x ".join(str(n) for n in shape) for shape in shapes)
        raise MeasuringError(
            "session.spots",
            f"The points of the job have spots of {words} numbers.",
            "They are of different cameras or probes: keep the file and begin a new job.",
        )
    return np.stack(spots)


RESTORED = "restored"
"""Event ``5 as 12`` if point 5 was restored as point 12."""
_RESTORED_AS = re.compile(r"([0-9]{1,10}) as ([0-9]{1,10})")

FLIPPED = "compensation flipped by the operator"
"""Reason of an annulment; the replacing point has the same observation."""


@dataclass(frozen=True, slots=True)
class Change:
    """Numbers of the points that a change added and removed."""

    added: tuple[int, ...]
    removed: tuple[int, ...]


class JobPoints:
    """Points of a job, consistent with its file."""

    def __init__(self, job: JobFile) -> None:
        self._job = job
        self.counting: list[MeasuredPoint] = job.points()
        """Points that are not annulled, oldest first."""
        self._out = {point.number: DeletedPoint(point, why) for point, why in job.annulled()}
        events = job.events()
        self._successor: dict[int, int] = {}
        for event in events:
            if event.kind == RESTORED:
                found = _RESTORED_AS.fullmatch(event.text)
                # A restored point has a larger number, so that there are no cycles.
                if found is None or not int(found[1]) < int(found[2]):
                    raise bad_event(RESTORED, f"{shortened(event.text)} names no two points")
                self._successor[int(found[1])] = int(found[2])
        self.held = {hold_reason: held_back(events, hold_reason) for hold_reason in HoldReason}
        self._own: set[int] = set()
        self._sensitivities: dict[int, tracking.TipSensitivity] = {}
        self._in_order: list[tracking.TipSensitivity] | None = None
        self._deleted: dict[str, tuple[DeletedPoint, ...]] | None = None
        """`_in_order`, `_deleted`: known answers of `sensitivities` and `all_deleted`."""

    def snapshot(self) -> JobPoints:
        """Return a copy for concurrent reading."""
        self.all_deleted()  # Once for all copies.
        twin = copy.copy(self)
        vars(twin).update(
            counting=list(self.counting),
            held={hold_reason: dict(held) for hold_reason, held in self.held.items()},
            _out=dict(self._out),
            _successor=dict(self._successor),
        )
        return twin

    def sensitivities(self, reference: ReferenceUse) -> list[tracking.TipSensitivity]:
        """Return those of the points that count, in order; errors of ``reference``."""
        if self._in_order is not None:
            return self._in_order
        # They depend only on the number: rows, cameras and body never change in a session.
        new = [point for point in self.counting if point.number not in self._sensitivities]
        found = reference.sensitivities([(point.spots, point.reference_spots) for point in new])
        self._sensitivities |= {p.number: one for p, one in zip(new, found, strict=True)}
        self._in_order = [self._sensitivities[point.number] for point in self.counting]
        return self._in_order

    @property
    def last_number(self) -> int:
        """Return the largest number of a point that counts; zero without any."""
        return self.counting[-1].number if self.counting else 0

    def count(self, feature: str) -> int:
        return sum(point.feature == feature for point in self.counting)

    def of_feature(self, feature: str) -> list[MeasuredPoint]:
        return [point for point in self.counting if point.feature == feature]

    def point(self, number: int) -> MeasuredPoint:
        """Return a point that counts; MeasuringError if it does not."""
        for point in self.counting:
            if point.number == number:
                return point
        raise MeasuringError(
            "session.no_such_point", f"No active point {number}.", "Choose a point from the list."
        )

    def all_deleted(self) -> dict[str, tuple[DeletedPoint, ...]]:
        """Return by feature the deleted points that were not restored."""
        if self._deleted is not None:
            return self._deleted
        found: dict[str, tuple[DeletedPoint, ...]] = {}
        for number, item in sorted(self._out.items()):
            if number not in self._successor and item.reason != FLIPPED:
                found[item.point.feature] = (*found.get(item.point.feature, ()), item)
        self._deleted = found
        return found

    def all_taken_out(self) -> tuple[tuple[MeasuredPoint, str], ...]:
        """Return all deleted points and why, oldest first; also restored ones."""
        return tuple((item.point, item.reason) for _, item in sorted(self._out.items()))

    def latest(self, number: int) -> int:
        """Return the current number of a point, after deletions and restorations."""
        while number in self._successor:
            number = self._successor[number]
        return number

    def next_number(self) -> int:
        return self._job.next_number()

    def add(
        self,
        points: Sequence[MeasuredPoint],
        sensitivities: Sequence[tracking.TipSensitivity],
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Make new points durable, all or none; StorageError if that fails."""
        self._job.change(append=points, events=events)
        numbers = [point.number for point in points]
        self._sensitivities |= dict(zip(numbers, sensitivities, strict=True))
        self._own |= set(numbers)
        if self._in_order is not None:
            self._in_order += sensitivities
        self.counting += points

    def planned(self, annul: Collection[int], restore: Collection[int] = ()) -> Change:
        """Return the effect of `change` with the same points."""
        first = self.next_number()
        return Change(tuple(range(first, first + len(restore))), tuple(annul))

    def change(
        self,
        annul: Mapping[int, str],
        restore: Sequence[int] = (),
        events: Sequence[tuple[str, str]] = (),
    ) -> Change:
        """Delete points, each for its reason, and restore others, in one transaction.

        MeasuringError if one to be deleted does not count, or one to be restored was not deleted;
        StorageError if not durable; nothing is changed.
        """
        if not (annul or restore or events):
            return Change((), ())
        out = [self.point(number) for number in annul]
        change = self.planned(annul, restore)
        back = [
            replace(self.taken_out(old), number=new)
            for old, new in zip(restore, change.added, strict=True)
        ]
        renamed = [(old, point.number) for old, point in zip(restore, back, strict=True)]
        told = [(RESTORED, f"{old} as {new}") for old, new in renamed]
        self._job.change(
            annul=annul, append=back, events=[*events, *told, *self._held_events(renamed)]
        )
        self._forget_answers()
        for point in out:
            self.counting.remove(point)
            self._out[point.number] = DeletedPoint(point, annul[point.number])
        self._successor |= dict(renamed)
        self.counting += back
        self._inherit(renamed)
        return change

    def replace(
        self,
        old: MeasuredPoint,
        new: MeasuredPoint,
        reason: str,
        events: Sequence[tuple[str, str]] = (),
    ) -> None:
        """Replace a point by another one; StorageError without a change."""
        renamed = [(old.number, new.number)]
        self._job.change(
            annul={old.number: reason}, append=[new], events=[*events, *self._held_events(renamed)]
        )
        self._forget_answers()
        self.counting.remove(old)
        self._out[old.number] = DeletedPoint(old, reason)
        self.counting.append(new)
        self._inherit(renamed)

    def hold_back(self, numbers: Iterable[int], reason: str, hold_reason: HoldReason) -> list[int]:
        """Hold points; return new ones. StorageError: not durable, held until the program ends."""
        new = [number for number in numbers if number not in self.held[hold_reason]]
        self.held[hold_reason] |= dict.fromkeys(new, reason)
        if new:
            self._job.append_event(hold_reason.held, event_text(new, reason))
        return new

    def taken_since(self, since_s: float | None) -> list[int]:
        """Return the points of this run since a bus time, s, or all of them."""
        # Points of earlier runs have another time base; deleted ones may be restored.
        out = [item.point for n, item in self._out.items() if n not in self._successor]
        return sorted(
            point.number
            for point in (*self.counting, *out)
            if point.number in self._own and (since_s is None or point.time_s >= since_s)
        )

    def release(self, reason: str, hold_reason: HoldReason) -> list[int]:
        """Release held points and return them; StorageError, they stay held then."""
        held = self.held[hold_reason]
        numbers = [n for n in held if hold_reason is not HoldReason.CAMERAS or n in self._own]
        return self.release_points(numbers, reason, hold_reason)

    def release_points(
        self, numbers: Iterable[int], reason: str, hold_reason: HoldReason
    ) -> list[int]:
        """Release these points and return those that were held; errors as `release`."""
        held = self.held[hold_reason]
        free = [number for number in numbers if number in held]
        if free:
            self._job.append_event(hold_reason.released, event_text(free, reason))
            self.held[hold_reason] = {k: v for k, v in held.items() if k not in free}
        return free

    def know(self, sensitivities: Mapping[int, tracking.TipSensitivity]) -> None:
        """Use sensitivities that were already computed from the raw observations, by number."""
        self._sensitivities |= sensitivities
        self._forget_answers()

    def forget_sensitivities(self) -> None:
        """Discard sensitivities, so that they are recalculated."""
        self._sensitivities.clear()
        self._forget_answers()

    def taken_out(self, number: int) -> MeasuredPoint:
        """Return a restorable point; MeasuringError if it is not."""
        item = self._out.get(number)
        if item is None or number in self._successor:
            raise MeasuringError(
                "session.not_deleted",
                f"Point {number} was not deleted, or is already restored.",
                "Choose a deleted point of the feature.",
            )
        return item.point

    def _forget_answers(self) -> None:
        self._in_order = self._deleted = None

    def _held_events(self, renamed: Sequence[tuple[int, int]]) -> list[tuple[str, str]]:
        return [
            (hold_reason.held, event_text([new], held[old]))
            for old, new in renamed
            for hold_reason, held in self.held.items()
            if old in held
        ]

    def _inherit(self, renamed: Sequence[tuple[int, int]]) -> None:
        for old, new in renamed:
            if old in self._sensitivities:
                self._sensitivities[new] = self._sensitivities[old]
            if old in self._own:
                self._own.add(new)
            for held in self.held.values():
                if old in held:
                    held[new] = held[old]
