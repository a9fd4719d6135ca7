from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Generic, TypeVar

from ocmm_core.calibration.cameras import KnownPointsProcedure, TrackerProcedure
from ocmm_core.calibration.guided import (
    GuidedProcedure,
    ProbeProcedure,
    ProcedureKind,
    RelocationView,
    SessionSetup,
    SessionSite,
    VerificationView,
)
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.calibration.sweeping import PivotProcedure
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure, TouchView
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_gui.kit import later, localised, tr
from ocmm_gui.wizards import _sessions as sessions
from ocmm_gui.wizards._site import Subject, WizardSite
from ocmm_gui.wizards.pages import (
    CALIBRATION_ENDS,
    VERDICT_ENDS,
    BarPage,
    ConePage,
    Field,
    FirstConePage,
    KnownPointsPage,
    LinesPage,
    PivotResultPage,
    PreparePage,
    ProbePreparePage,
    ResultPage,
    SeatsPage,
    SpherePage,
    SpheresPage,
    StepPage,
    SweepPage,
    TipCheckResultPage,
    TipResultPage,
    TrackerPage,
    TrackerResultPage,
    VerdictPage,
    WavePage,
    WizardTexts,
    WorldPage,
    planned_lines,
    planned_points,
    repeat_worst,
)

P = TypeVar("P", bound=GuidedProcedure[Any, Any, Any, Any])
Command = Callable[[datetime], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class WizardSpec(Generic[P]):
    """Wizard over a procedure of the core; pages hold sounds, far reading and painting."""

    procedure: type[P]
    action: str
    """Key of the window action that opens it, in `kit.ACTIONS`."""
    texts: WizardTexts
    fields: Callable[[WizardSite], tuple[Field, ...]]
    setup: Callable[[Mapping[str, str], datetime], SessionSetup]
    """Makes the setup of a session from the values of the fields."""
    pages: Callable[[SessionSite, P], dict[str, StepPage]]
    """Pages by step name; the last one shows the result."""
    is_slow: bool
    """Calculate the result in a separate process, so that the window never freezes."""
    predict: Callable[[P], None] | None = None
    """Predicts the quality of the result so far; None if unsupported."""
    commands: Mapping[str, Callable[[P], Command]] = field(default_factory=dict)
    """Commands of the keys ``skip``, ``repeat`` and ``anew`` of `WIZARD_ACTIONS`, if available."""

    @property
    def kind(self) -> ProcedureKind:
        return self.procedure.kind

    @property
    def subject(self) -> Subject:
        """Determines its records and its page of Maintain."""
        return Subject.PROBE if issubclass(self.procedure, ProbeProcedure) else Subject.CAMERAS

    def applies(self, rig: Rig) -> bool:
        """Return whether a rig, of cameras or a tracker, can use it."""
        of = self.procedure
        return of.for_cameras if rig.markers is None else of.for_trackers


def wizard_of(kind: ProcedureKind) -> WizardSpec[Any]:
    """Return the wizard of a kind of procedure; raise InputError if unknown."""
    for spec in WIZARDS:
        if spec.kind is kind:
            return spec
    raise InputError(
        "wizard.unknown",
        f"No wizard for {kind.value} in this version.",
        "Use ocmm calibrate on a terminal, or a version with this wizard.",
    )


_VERIFY = later(
    "The new calibration is active. Verify it: until then it is SUSPECT and no points are taken."
)

_KNOWN_POINTS = WizardSpec(
    procedure=KnownPointsProcedure,
    action="calibrate",
    texts=WizardTexts(
        title=later("Calibrate cameras"),
        purpose=later(
            "A positioning machine moves one bright target to every point of a list, "
            "through the full depth of the volume. Lens parameters and camera poses are "
            "computed from the images."
        ),
        ends=CALIBRATION_ENDS,
        accepted=_VERIFY,
    ),
    fields=sessions.known_points_fields,
    setup=sessions.known_points_setup,
    pages=lambda place, procedure: {
        "prepare": PreparePage(place.rig, planned_points),
        "collect": KnownPointsPage(place.rig, procedure),
        "result": ResultPage(place.rig, tr("Errors at points held back")),
    },
    is_slow=True,
    commands={"skip": lambda procedure: procedure.skip},
)

_RELOCATION = WizardSpec(
    procedure=RelocationProcedure,
    action="relocate",
    texts=WizardTexts(
        title=later("Relocate"),
        purpose=later(
            "Use after the frame or a camera was moved: visit two seats, wave the probe "
            "through the volume, show the length bar, touch the control points, and visit "
            "the seats again. No measuring machine needed."
        ),
        ends=CALIBRATION_ENDS,
        accepted=_VERIFY,
    ),
    fields=sessions.relocation_fields,
    setup=sessions.relocation_setup,
    pages=lambda place, _procedure: {
        "prepare": PreparePage(place.rig),
        "seats": SeatsPage(place.rig, RelocationView, again=False),
        "wave": WavePage(place.rig),
        "bar": BarPage(place.rig),
        "world": WorldPage(place.rig),
        "again": SeatsPage(place.rig, RelocationView, again=True),
        "result": ResultPage(place.rig, tr("Misfits of bar and control points")),
    },
    is_slow=True,
    predict=RelocationProcedure.predict,
)

_TRACKER = WizardSpec(
    procedure=TrackerProcedure,
    action="tracker",
    texts=WizardTexts(
        title=later("Calibrate tracker"),
        purpose=later(
            "Measures the noise of an optical tracker: the clamped probe rests for a minute, then "
            "at places all over the volume. Scale and noise are proven by the verification."
        ),
        ends=CALIBRATION_ENDS,
        accepted=_VERIFY,
    ),
    fields=sessions.tracker_fields,
    setup=sessions.tracker_setup,
    pages=lambda place, _procedure: {
        "prepare": PreparePage(place.rig),
        "rest": TrackerPage(place.rig),
        "places": TrackerPage(place.rig),
        "result": TrackerResultPage(place.rig),
    },
    is_slow=False,
)

_VERIFICATION = WizardSpec(
    procedure=VerificationProcedure,
    action="verify",
    texts=WizardTexts(
        title=later("Verify"),
        purpose=later(
            "An independent check: visit two seats, put the ball into the nests of a "
            "certified length bar along seven lines, touch a certified sphere, and visit "
            "the seats again. Only a calibration that passes can be used."
        ),
        ends=VERDICT_ENDS,
        accepted=later("Verdict stored."),
    ),
    fields=sessions.verification_fields,
    setup=sessions.verification_setup,
    pages=lambda place, _procedure: {
        "prepare": PreparePage(place.rig, planned_lines),
        "seats": SeatsPage(place.rig, VerificationView, again=False),
        "lines": LinesPage(place.rig),
        "spheres": SpheresPage(place.rig),
        "again": SeatsPage(place.rig, VerificationView, again=True),
        "result": VerdictPage(),
    },
    is_slow=False,
    commands={"repeat": lambda procedure: repeat_worst(procedure, procedure.view)},
)


def _pivot_pages(place: SessionSite, procedure: PivotProcedure) -> dict[str, StepPage]:
    view = procedure.view
    return {
        "prepare": ProbePreparePage(place.body, ((tr("Probe"), view.probe), (tr("Tip"), view.tip))),
        "first": SweepPage(place.rig, second=False),
        "second": SweepPage(place.rig, second=True),
        "again": FirstConePage(place.rig),
        "result": PivotResultPage(place.rig),
    }


_PIVOT = WizardSpec(
    procedure=PivotProcedure,
    action="pivot",
    texts=WizardTexts(
        title=later("Calibrate probe"),
        purpose=later(
            "Rest the ball in a cone and pivot the probe about it, repeat in another cone "
            "or leaning another way, then return to the first cone. Tip and LED positions "
            "are computed from the sweeps."
        ),
        ends=CALIBRATION_ENDS,
        accepted=later(
            "The new probe calibration is active. Qualify the tip: until then it is "
            "SUSPECT and no points are taken."
        ),
    ),
    fields=sessions.pivot_fields,
    setup=sessions.pivot_setup,
    pages=_pivot_pages,
    is_slow=True,
    commands={"anew": lambda procedure: procedure.sweep_anew},
)


def _touch_pages(place: SessionSite, view: TouchView, result: StepPage) -> dict[str, StepPage]:
    """Return the pages of qualification and check, which differ in their result."""
    sphere = localised(
        f"{view.sphere_diameter_mm:.4f} mm, U {1e3 * view.sphere_expanded_mm:.1f} µm"
    )
    facts = (
        (tr("Probe"), view.probe), (tr("Tip"), view.tip),
        (tr("Ball"), localised(f"{view.nominal_mm:g} mm")),
        (view.sphere_name, sphere),
    )  # fmt: skip
    return {
        "prepare": ProbePreparePage(place.body, facts),
        "sphere": SpherePage(place.rig),
        "cone": ConePage(place.rig),
        "result": result,
    }


_QUALIFICATION = WizardSpec(
    procedure=TipQualificationProcedure,
    action="qualify",
    texts=WizardTexts(
        title=later("Qualify tip"),
        purpose=later(
            "Touch a certified sphere all around, then rest the ball in a cone in five "
            "attitudes. This gives the diameter and form of the ball, and shows whether the "
            "tip stays in place."
        ),
        ends=VERDICT_ENDS,
        accepted=later("Tip verdict stored."),
    ),
    fields=sessions.qualification_fields,
    setup=sessions.qualification_setup,
    pages=lambda place, procedure: _touch_pages(place, procedure.view, TipResultPage(place.rig)),
    is_slow=False,
)

_TIP_CHECK = WizardSpec(
    procedure=TipCheckProcedure,
    action="check_tip",
    texts=WizardTexts(
        title=later("Check tip"),
        purpose=later("One minute on the sphere and in the cone: is the tip still as qualified?"),
        ends=VERDICT_ENDS,
        accepted=later("Tip verdict stored."),
    ),
    fields=sessions.tip_check_fields,
    setup=sessions.tip_check_setup,
    pages=lambda place, procedure: _touch_pages(place, procedure.view, TipCheckResultPage()),
    is_slow=False,
)

WIZARDS: tuple[WizardSpec[Any], ...] = (
    _KNOWN_POINTS, _RELOCATION, _TRACKER, _VERIFICATION, _TIP_CHECK, _QUALIFICATION, _PIVOT,
)  # fmt: skip
"""In the order of the pages of Maintain."""
