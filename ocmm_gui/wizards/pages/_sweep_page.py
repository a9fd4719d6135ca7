from __future__ import annotations

import numpy as np

from ocmm_core.calibration.sweeping import (
    CELL_RAD,
    COUNTDOWN_S,
    MapCell,
    PivotView,
    SweepPhase,
    SweepView,
)
from ocmm_core.camera import Rig
from ocmm_core.geometry import Points3
from ocmm_gui.charts import Bars, Mapped, Row
from ocmm_gui.kit import Mark, Sound, later, localised, said, tr, tr_all
from ocmm_gui.wizards.parts import HandsPage, Score, Seen, Told

_TURNS = (later("Leaning"), later("Leaning the other way"), later("Turning the handle"))
_SEATED = later("Ball in the cone: keep it there.")
_SOUNDS = {
    SweepPhase.COUNTDOWN: Sound.TICK,
    SweepPhase.TAKING: Sound.STARTED,
    SweepPhase.LEFT: Sound.REFUSED,
}


class SweepPage(HandsPage):
    """One sweep: starts when the ball rests in the cone, ends when complete."""

    keys = ("back", "drop", "anew", "next")

    def __init__(self, rig: Rig, *, second: bool) -> None:
        super().__init__(rig, tr("Sweep"), tr("Directions of the probe"))
        self._second = second
        self._phase = SweepPhase.IDLE
        self._cells: tuple[MapCell, ...] = ()
        self._mapped = Mapped()
        self.sigma = Score(tr("Uncertainty of the tip"))
        self.bars = Bars(tr("Rotation of the probe"), 6 if second else 5)
        self.scores.addWidget(self.sigma, 2)
        self.scores.addWidget(self.bars, 6)

    def show_seen(self, seen: Seen) -> None:
        view = seen.view_as(PivotView)
        self.show_cameras(view.base.live)
        sweep = view.second if self._second else view.first
        self.banner.tell(told_of(view, sweep))
        if sweep.phase is not self._phase:
            self._phase = sweep.phase
            if sweep.phase in _SOUNDS:
                self.sounded.emit(_SOUNDS[sweep.phase])
        if sweep.cells is not self._cells or not np.array_equal(
            view.direction_world, self._mapped.now, equal_nan=True
        ):
            self._cells = sweep.cells
            self._mapped = mapped_of(view, sweep)
            self.map.show_map(self._mapped)
        wanted, sigma = sweep.tip_sigma_wanted_mm, sweep.tip_sigma_mm
        known = bool(np.isfinite(sigma)) and sigma > 0.0
        self.sigma.show_score(
            localised(f"{2e3 * sigma:.1f} µm") if known else "–",
            tr("(k = 2); {wanted:.0f} µm is enough").format(wanted=2e3 * wanted)
            if known
            else tr("too early to tell"),
            min(wanted / sigma, 1.0) if known else 0.0,
        )
        self.bars.show_rows(self._rows(view, sweep))

    def _rows(self, view: PivotView, sweep: SweepView) -> list[Row]:
        rows = [
            Row(name, f"{found:.0f}° / {wanted:.0f}°", found / wanted if wanted else 1.0)
            for name, found, wanted in zip(
                tr_all(_TURNS),
                np.degrees(sweep.ranges),
                np.degrees(sweep.ranges_wanted),
                strict=True,
            )
        ]
        for name, done, wanted in (
            (tr("Attitudes"), sweep.attitudes, sweep.attitudes_wanted),
            (tr("Poses"), sweep.poses, sweep.poses_wanted),
        ):
            rows.append(Row(name, f"{done} / {wanted}", done / max(wanted, 1)))
        if self._second:
            rows.append(_elsewhere(view))
        return rows


class FirstConePage(HandsPage):
    """The ball rests in the first cone again, held as at the start."""

    keys = ("back", "take", "next")

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig, tr("First cone again"), tr("Directions of the first sweep"))
        self.visits = Score(tr("The first cone again"))
        self.scores.addWidget(self.visits)

    def show_seen(self, seen: Seen) -> None:
        view = seen.view_as(PivotView)
        self.show_cameras(view.base.live)
        step = view.base.step
        self.map.show_map(mapped_of(view, view.first))
        if step.gate.open:
            self.banner.tell(Told(tr("COMPLETE"), tr("Nothing is missing."), Mark.GOOD, 1.0))
        else:
            hint = said(view.base.live.hint or step.instruction)
            self.banner.tell(Told(tr("BACK INTO THE FIRST CONE"), hint, Mark.DOUBT))
        share = 1.0 if step.gate.open else 0.0
        self.visits.show_score(f"{step.done} / {step.wanted}", tr("held as at the start"), share)


def told_of(view: PivotView, sweep: SweepView) -> Told:
    hint = said(view.base.live.hint)
    if sweep.phase is SweepPhase.COUNTDOWN:
        seconds = max(view.countdown_s or 0.0, 0.0)
        share = 1.0 - seconds / COUNTDOWN_S
        return Told(
            tr("STARTS IN {seconds}").format(seconds=int(np.ceil(seconds))),
            tr(_SEATED),
            Mark.ACTIVE,
            share,
        )
    if sweep.phase is SweepPhase.TAKING:
        missing = sweep.missing or hint
        return Told(tr("SWEEP"), missing, Mark.ACTIVE, min(sweep.covered, 1.0))
    if sweep.phase is SweepPhase.LEFT:
        return Told(tr("BALL LEFT THE CONE"), hint, Mark.BAD, min(sweep.covered, 1.0))
    if sweep.phase is SweepPhase.GOOD:
        return Told(tr("COMPLETE"), tr("Nothing is missing."), Mark.GOOD, 1.0)
    return Told(tr("BALL INTO THE CONE"), hint, Mark.DOUBT)


def mapped_of(view: PivotView, sweep: SweepView) -> Mapped:
    wanted = [cell for cell in sweep.cells if cell.wanted]
    groups = (
        [cell for cell in wanted if cell.poses],
        [cell for cell in wanted if not cell.poses],
        [cell for cell in sweep.cells if not cell.wanted],
    )
    done, missing, extra = (_directions(group) for group in groups)
    return Mapped(
        middle=sweep.map_middle_world, done=done, open=missing, extra=extra,
        now=view.direction_world, spacing=CELL_RAD,
    )  # fmt: skip


def _directions(cells: list[MapCell]) -> Points3:
    return np.array([cell.direction_world for cell in cells]).reshape(-1, 3)


def _elsewhere(view: PivotView) -> Row:
    """Return the difference of the second sweep from the first, in place or attitude."""
    place, attitude = view.place_distance_mm, view.attitude_distance
    ways = [
        (place / view.place_wanted_mm, f"{place:.0f} / {view.place_wanted_mm:.0f} mm"),
        (
            attitude / view.attitude_wanted,
            f"{np.degrees(attitude):.0f}° / {np.degrees(view.attitude_wanted):.0f}°",
        ),
    ]
    known = [way for way in ways if np.isfinite(way[0])]
    share, value = max(known, default=(0.0, "–"))
    return Row(tr("Away from the first"), value, share)
