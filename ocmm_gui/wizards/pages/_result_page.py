"""Result of a camera calibration: residuals, and changes from the one in force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtWidgets import QVBoxLayout, QWidget

from ocmm_core.calibration.guided import CalibrationComparison, CalibrationOutcome, CameraChange
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, Rig
from ocmm_gui.charts import AllSensors, ResidualHistogram, SpaceArrows
from ocmm_gui.kit import Mark, NumberTable, day_words, later, localised, sentence_label, tr, tr_all
from ocmm_gui.wizards.parts import ResultFrame, Said

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
        self.summary = sentence_label(tr("What changes"), 16)
        self.cameras = NumberTable(tr("Changes of the cameras"), tr_all(_CHANGES))
        self.space = SpaceArrows(tr("Points of the volume, after minus before"), rig)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.summary)
        layout.addWidget(self.cameras)
        layout.addWidget(self.space, 1)

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


class ResultPage(ResultFrame):
    """Residuals, errors in space and comparison of a camera calibration."""

    plots = (later("Sensors"), later("Histogram"), later("Space"), later("Before/after"))

    def __init__(self, rig: Rig, errors: str) -> None:
        views = (AllSensors(rig), ResidualHistogram(), SpaceArrows(errors, rig), CompareView(rig))
        super().__init__(tuple(zip(tr_all(self.plots), views, strict=True)))
        self.sensors, self.histogram, self.space, self.compare = views

    def judge(self, outcome: object) -> Said:
        if isinstance(outcome, CalibrationOutcome) and outcome.warnings:
            return Said(
                tr("USABLE, CHECK"),
                Mark.DOUBT,
                tr("The calibration can be used, but with reservations; see below."),
            )
        return Said(
            tr("GOOD"),
            Mark.GOOD,
            tr("No objections to this calibration. After accepting, verify it."),
        )

    def fill(self, outcome: object) -> tuple[Sequence[tuple[str, str]], Sequence[Finding]]:
        if not isinstance(outcome, CalibrationOutcome):
            return (), ()
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
            (tr("Residuals"), localised(f"{record.rms_px:.4f} px RMS")),
            (tr("chi² / dof"), localised(f"{record.chi2_per_dof:.3f}")),
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
                localised(f"U {2e3 * float(np.sqrt(variance.max())):.2f} µm (k = 2)"),
            ),
        ]
        if len(outcome.errors_world):
            rms = 1e3 * np.sqrt(np.mean(outcome.errors_world**2, axis=0))
            words = "X {:.1f}, Y {:.1f}, Z {:.1f} µm".format(*rms)
            facts.append((tr("Errors RMS"), localised(words)))
        facts.append((tr("Valid until"), day_words(record.valid_until_utc)))
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


def _change_words(one: CameraChange) -> tuple[str, ...]:
    return (
        one.name,
        localised(f"{one.shift_mm:.4f}"),
        localised(f"{1e3 * one.turn_rad:.4f}"),
        localised(f"{one.focal_mm:+.5f}"),
        localised(f"{one.u0_px:+.3f}"),
        localised(f"{one.v0_px:+.3f}"),
    )


def _um(value_mm: float) -> str:
    return localised(f"{1e3 * value_mm:.1f} µm")
