"""Results of camera and pivot calibrations: residuals, uncertainty, and changes."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.guided import CalibrationComparison, CalibrationOutcome, CameraChange
from ocmm_core.calibration.sweeping import PivotChange, PivotOutcome, led_paths
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, Rig, noise_pairs
from ocmm_core.geometry import Float
from ocmm_gui import kit
from ocmm_gui.charts import (
    AllSensors,
    ResidualHistogram,
    SpaceArrows,
    SpotResiduals,
    TipCourse,
    Trail,
    TrailPlot,
)
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages._result_frame import Filled, ResultFrame, ResultVerdict

_CHANGES = (
    (later("Camera"), later("which camera")),
    (later("Shift mm"), later("shift of its centre, common motion removed")),
    (later("Turn mrad"), later("rotation, common motion removed")),
    ("f mm", later("focal length, after minus before")),
    ("u0 px", later("principal point, after minus before")),
    ("v0 px", later("principal point, after minus before")),
)


class CompareView(QWidget):
    """New calibration compared with the one in force."""

    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName(tr("Before and after"))
        self.summary = kit.sentence_label(tr("What changes"), 16)
        self.cameras = kit.NumberTable(tr("Changes of the cameras"), kit.tr_all(_CHANGES))
        self.space = SpaceArrows(tr("Points of the volume, after minus before"), rig)
        kit.vbox(self.summary, self.cameras, (self.space, 1), parent=self, spacing=8, margins=0)

    def show_comparison(self, comparison: CalibrationComparison | None) -> None:
        """Show the differences; None without a calibration in force."""
        self.cameras.setVisible(comparison is not None)
        self.space.setVisible(comparison is not None)
        if comparison is None:
            self.summary.setText(tr("First calibration of these cameras: nothing to compare with."))
            return
        before, after = comparison.length_sigma_before_mm, comparison.length_sigma_after_mm
        self.summary.setText(
            tr(
                "All cameras together moved by {moved_mm:.3f} mm and rotated by "
                "{turned_rad:.3f} mrad; the remaining change of each camera is below. "
                "U of a length (k = 2): {before} before, {after} after."
            ).format(
                moved_mm=comparison.moved_mm,
                turned_rad=1e3 * comparison.turned_rad,
                before=_um(2.0 * before),
                after=_um(2.0 * after),
            )
        )
        self.cameras.show_rows([_change_words(one) for one in comparison.cameras])
        self.space.show_vectors(
            comparison.nodes_world, comparison.differences_world, tr("no points")
        )


class ResultPage(ResultFrame[CalibrationOutcome]):
    """Residuals, errors in space and comparison of a camera calibration."""

    shows = CalibrationOutcome
    plots = (later("Sensors"), later("Histogram"), later("Volume"), later("Before/after"))

    def __init__(self, rig: Rig, errors: str) -> None:
        views = (AllSensors(rig), ResidualHistogram(), SpaceArrows(errors, rig), CompareView(rig))
        super().__init__(tuple(zip(kit.tr_all(self.plots), views, strict=True)))
        self.sensors, self.histogram, self.space, self.compare = views

    def judge(self, outcome: CalibrationOutcome) -> ResultVerdict:
        return _judged(outcome)

    def fill(self, outcome: CalibrationOutcome) -> Filled:
        record, comparison = outcome.record, outcome.comparison
        self.sensors.show_residuals(outcome.residuals)
        self.histogram.show_residuals(outcome.residuals)
        self.space.show_vectors(
            outcome.errors_at_world, outcome.errors_world, tr("no points held back")
        )
        self.compare.show_comparison(comparison)
        focal = PARAMETERS.index("focal")
        variance = np.diag(outcome.rig.parameter_covariance)[focal::N_PARAMETERS]
        left_out = ", ".join(record.outliers[:4]) + (" …" if len(record.outliers) > 4 else "")
        facts = [
            (tr("Residuals"), kit.localised(f"{record.rms_px:.4f} px RMS")),
            (tr("chi² / dof"), kit.localised(f"{record.chi2_per_dof:.3f}")),
            (
                tr("Used"),
                tr(
                    "%n positions, {held} more held back",
                    "1 position, {held} more held back",
                    record.points,
                ).format(held=len(outcome.errors_at_world)),
            ),
            (
                tr("Left out"),
                f"{len(record.outliers)}  {left_out}" if record.outliers else tr("none"),
            ),
            (
                tr("Focal length"),
                kit.localised(f"U {2e3 * float(np.sqrt(variance.max())):.2f} µm (k = 2)"),
            ),
        ]
        if len(outcome.errors_world):
            rms = 1e3 * np.sqrt(np.mean(outcome.errors_world**2, axis=0))
            words = "X {:.1f}, Y {:.1f}, Z {:.1f} µm".format(*rms)
            facts.append((tr("Errors RMS"), kit.localised(words)))
        facts.append((tr("Valid until"), kit.day_words(record.valid_until_utc)))
        if comparison is not None:
            before, after = comparison.length_sigma_before_mm, comparison.length_sigma_after_mm
            facts.append(
                (
                    tr("Length"),
                    tr("U {before} before, {after} after (k = 2)").format(
                        before=_um(2.0 * before), after=_um(2.0 * after)
                    ),
                )
            )
        return facts, outcome.warnings


def _usable() -> ResultVerdict:
    return ResultVerdict(
        tr("USABLE, CHECK"),
        kit.Mark.DOUBT,
        tr("The calibration can be used, but with reservations; see below."),
    )


def _judged(outcome: CalibrationOutcome) -> ResultVerdict:
    if outcome.warnings:
        return _usable()
    return ResultVerdict(
        tr("GOOD"),
        kit.Mark.GOOD,
        tr("No objections to this calibration. After accepting, verify it."),
    )


class TrackerResultPage(ResultFrame[CalibrationOutcome]):
    """Measured noise of a tracker next to the stated one."""

    shows = CalibrationOutcome

    def __init__(self, rig: Rig) -> None:
        heads = (
            (later("Noise"), later("field of the document of the tracker")),
            (later("Before"), later("in force until now, or of the document")),
            (later("Measured"), later("in force after accepting")),
        )
        self.table = kit.NumberTable(tr("Noise of the tracker"), kit.tr_all(heads), whole=False)
        super().__init__(((tr("Noise"), self.table),))
        self._rig = rig

    def judge(self, outcome: CalibrationOutcome) -> ResultVerdict:
        return _judged(outcome)

    def fill(self, outcome: CalibrationOutcome) -> Filled:
        before = self._rig.markers
        if before is None:
            return (), ()
        after = outcome.rig.markers
        assert after is not None  # noqa: S101 - of the same tracker
        pairs = noise_pairs(before.document.noise, after.document.noise)
        self.table.show_rows([tuple(map(kit.localised, one)) for one in pairs])
        record = outcome.record
        facts = [
            (tr("Used"), tr("%n places", "1 place", record.points)),
            (tr("Valid until"), kit.day_words(record.valid_until_utc)),
        ]
        return facts, outcome.warnings


def _change_words(one: CameraChange) -> tuple[str, ...]:
    return (
        one.name,
        kit.localised(f"{one.shift_mm:.4f}"),
        kit.localised(f"{1e3 * one.turn_rad:.4f}"),
        kit.localised(f"{one.focal_mm:+.5f}"),
        kit.localised(f"{one.u0_px:+.3f}"),
        kit.localised(f"{one.v0_px:+.3f}"),
    )


def _um(value_mm: float) -> str:
    return kit.localised(f"{1e3 * value_mm:.1f} µm")


_TIP = (
    ("", later("coordinate in the frame of the probe document")),
    (later("This, mm"), later("this calibration")),
    ("U, µm", later("expanded uncertainty (k = 2)")),
    (later("2nd, µm"), later("second minus first sweep")),
    ("U, µm", later("expanded uncertainty of that difference (k = 2)")),
    (later("Spheres, µm"), later("mean of the sphere centres (thesis 3.2), minus this")),
    (later("Change, µm"), later("this minus the active calibration")),
)
_IN_FRAME = later("in the frame of the probe document")
_LEDS = (
    (later("LED"), later("its number")),
    ("X, mm", _IN_FRAME),
    ("Y, mm", _IN_FRAME),
    ("Z, mm", _IN_FRAME),
    (later("2nd, µm"), later("second sweep from first")),
    (later("Change, µm"), later("against the active calibration")),
)


class PivotCompare(QWidget):
    """New calibration compared with second sweep, thesis method and the one in force."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Before and after"))
        self.summary = kit.sentence_label(tr("What changes"), 16)
        self.tip = kit.NumberTable(tr("The tip compared"), kit.tr_all(_TIP))
        self.leds = kit.NumberTable(tr("The LEDs compared"), kit.tr_all(_LEDS), whole=False)
        kit.vbox(self.summary, self.tip, (self.leds, 1), parent=self, spacing=8, margins=0)

    def show_outcome(self, outcome: PivotOutcome) -> None:
        spread = 1e3 * outcome.first.thesis.spread
        ball = tr("LED sphere centres scatter {spread:.1f} µm (RMS) about their mean.").format(
            spread=spread
        )
        self.summary.setText(f"{_tip_change_words(outcome.change)} {ball}")
        self.tip.show_rows(_tip_rows(outcome))
        self.leds.show_rows(_led_rows(outcome))


class PivotResultPage(ResultFrame[PivotOutcome]):
    """Paths, tips, residuals and comparison of a pivot calibration."""

    shows = PivotOutcome
    plots = (later("Paths"), later("Tip"), later("Spots"), later("Before/after"))

    def __init__(self, rig: Rig) -> None:
        views = (TrailPlot(rig), TipCourse(), SpotResiduals(rig), PivotCompare())
        super().__init__(tuple(zip(kit.tr_all(self.plots), views, strict=True)))
        self.trails, self.tips, self.spots, self.compare = views
        self._outcome: PivotOutcome | None = None

    def must_say_why(self) -> str:
        """Return the question about an unusually large tip change."""
        outcome = self._outcome
        if outcome is None or outcome.change is None or not outcome.must_be_confirmed:
            return ""
        return tr("The tip moved by {tip_distance:.3f} mm. Why?").format(
            tip_distance=outcome.change.tip_distance
        )

    def judge(self, outcome: PivotOutcome) -> ResultVerdict:
        if outcome.must_be_confirmed and outcome.change is not None:
            return ResultVerdict(
                tr("TIP CHANGED"),
                kit.Mark.DOUBT,
                tr(
                    "The tip has moved by {tip_distance:.3f} mm. Accept only if you know why; "
                    "you will be asked for the reason."
                ).format(tip_distance=outcome.change.tip_distance),
            )
        if outcome.findings:
            return _usable()
        return ResultVerdict(
            tr("GOOD"),
            kit.Mark.GOOD,
            tr("Both sweeps give the same tip. After accepting, qualify the tip on the sphere."),
        )

    def fill(self, outcome: PivotOutcome) -> Filled:
        self._outcome = outcome
        first, second, validation = outcome.first, outcome.second, outcome.validation
        self.trails.show_trails(
            [
                Trail(tr("first"), led_paths(first), first.centre_world),
                Trail(tr("second"), led_paths(second), second.centre_world),
            ]
        )
        self.tips.show_sweeps((first, second))
        self.spots.show_sweep(first)
        self.compare.show_outcome(outcome)
        left_out = len(first.left_out)
        facts = [
            (tr("Tip"), f"U {_um(2.0 * first.tip_sigma)} (k = 2)"),
            (
                tr("2nd sweep"),
                tr("{distance} away").format(distance=_um(_length(validation.tip_difference))),
            ),
            (
                tr("Poses"),
                tr("{used}, {left_out} left out").format(
                    used=int(first.used.sum()), left_out=left_out or tr("none")
                ),
            ),
            (tr("Turned"), "{:.0f}°, {:.0f}°, {:.0f}°".format(*np.degrees(first.coverage.ranges))),
            (tr("Residuals"), kit.localised(f"{first.rms_px:.4f} px RMS")),
            (tr("chi² / dof"), kit.localised(f"{first.chi2 / max(first.dof, 1):.3f}")),
            (tr("Valid until"), kit.day_words(outcome.record.valid_until_utc)),
        ]
        if np.isfinite(validation.articulation_2s):
            facts.append((tr("Articulation"), f"2s {_um(validation.articulation_2s)}"))
        return facts, outcome.findings


def _tip_rows(outcome: PivotOutcome) -> list[tuple[str, ...]]:
    first, validation, change = outcome.first, outcome.validation, outcome.change
    sigma = np.sqrt(np.diag(first.tip_covariance))
    thesis = first.thesis_tip_probe - first.tip_probe
    return [
        (
            tr("tip {axis}").format(axis="XYZ"[axis]),
            kit.localised(f"{first.tip_probe[axis]:.4f}"),
            kit.localised(f"{2e3 * sigma[axis]:.1f}"),
            kit.localised(f"{1e3 * validation.tip_difference[axis]:+.1f}"),
            kit.localised(f"{2e3 * validation.tip_difference_sigma[axis]:.1f}"),
            kit.localised(f"{1e3 * thesis[axis]:+.1f}"),
            "–" if change is None else kit.localised(f"{1e3 * change.tip_difference[axis]:+.1f}"),
        )
        for axis in range(3)
    ]


def _led_rows(outcome: PivotOutcome) -> list[tuple[str, ...]]:
    leds, change = outcome.first.leds_probe, outcome.change
    second = np.linalg.norm(outcome.second.leds_probe - leds, axis=1)
    moved = None if change is None else np.linalg.norm(change.led_differences, axis=1)
    return [
        (
            kit.led_name(led),
            *(kit.localised(f"{value:.3f}") for value in place),
            kit.localised(f"{1e3 * second[led]:.1f}"),
            "–" if moved is None else kit.localised(f"{1e3 * moved[led]:.1f}"),
        )
        for led, place in enumerate(leds)
    ]


def _tip_change_words(change: PivotChange | None) -> str:
    if change is None:
        return tr("First calibration of this tip: nothing to compare with.")
    when = datetime.fromisoformat(change.previous.made_utc).astimezone()
    return tr(
        "Since the calibration of {when} the tip moved by "
        "{tip_distance:.4f} mm and the LEDs by {led_rms:.4f} mm (RMS)."
    ).format(when=kit.day_words(when), tip_distance=change.tip_distance, led_rms=change.led_rms)


def _length(vector: Float) -> float:
    return float(np.linalg.norm(vector))
