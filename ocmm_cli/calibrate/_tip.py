"""``ocmm calibrate tip`` and ``check-tip``: touch a sphere all around, then a cone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from ocmm_cli.calibrate._setup import ProbeSetup
from ocmm_cli.terminal import PlainConsole, lead, make_console, print_table_account
from ocmm_core.errors import CalibrationError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_cli.calibrate._steps import TerminalProbeSite
    from ocmm_core.calibration.guided import Shot
    from ocmm_core.calibration.records import ArtefactUse
    from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure, TouchSetup
    from ocmm_sim.calibration_scenes import Scene
    from ocmm_sim.sources import VirtualSite

    T = TypeVar("T", TipQualificationProcedure, TipCheckProcedure)


_FAULTS: dict[str, dict[str, float]] = {
    "good": {},
    "wrong-diameter": {"diameter_mm": 0.05},
    "wrong-length": {"length_mm": 1.0},
    "worn": {"worn_mm": 0.1},
}


def tip_command(
    *, tip: str | None, sphere: Path, cone: str, diameter: float | None, valid_days: int,
    shots: Path | None, spot: TableOptions, setup: ProbeSetup,
) -> None:  # fmt: skip
    """Qualify a tip: its ball on a calibrated sphere (25 points), and in a cone (five attitudes).

    The record contains the ball diameter, its uncertainty and its validity. No touched point is
    left out; points that do not fit are named.
    """
    from ocmm_cli.calibrate._tip_report import print_qualification
    from ocmm_core.calibration.tip import QualificationSetup, TipQualificationProcedure

    stated = partial(QualificationSetup, nominal_mm=diameter, valid_days=valid_days)
    _run(
        TipQualificationProcedure, stated, print_qualification, tip, sphere, cone, shots, spot,
        setup,
    )  # fmt: skip


def check_tip_command(
    *, tip: str | None, sphere: Path, cone: str, shots: Path | None, spot: TableOptions,
    setup: ProbeSetup,
) -> None:  # fmt: skip
    """Check in a minute that the tip is still the qualified one: 13 points, five attitudes.

    Detects a diameter off by 50 um and a length off by 0.2 mm. If the points do not decide, the
    check asks for more of them; an uncertain check never passes.
    """
    from ocmm_cli.calibrate._tip_report import print_check
    from ocmm_core.calibration.tip import TipCheckProcedure, TouchSetup

    _run(TipCheckProcedure, TouchSetup, print_check, tip, sphere, cone, shots, spot, setup)


def _run(
    kind: type[T],
    stated: Callable[..., TouchSetup],
    print_outcome: Callable[[PlainConsole, Any], None],
    tip: str | None,
    sphere: Path,
    cone: str,
    shots: Path | None,
    spot: TableOptions,
    setup: ProbeSetup,
) -> None:
    """Measure with the mounted tip, resuming a session if possible, and store or discard.

    Prints result and status of the tip, and exits with 1 unless all is well.
    """
    from ocmm_cli.calibrate._run import decide, now, opened
    from ocmm_cli.calibrate._steps import open_probe_site
    from ocmm_cli.calibrate._tip_report import print_tip_status
    from ocmm_core.calibration.guided import ProcedureDecision
    from ocmm_core.calibration.records import load_sphere

    console = make_console()
    place = open_probe_site(setup, console)
    name = _mounted(place, tip, setup.who, console)
    asked = stated(who=setup.who, tip=name, sphere=load_sphere(sphere), cone=_cone(cone))
    procedure = opened(kind, place.of_probe, asked, setup, console)
    _record_missing(procedure, place, shots, spot, setup, console)
    outcome = procedure.view.outcome
    if outcome is not None:
        print_outcome(console, outcome)
    passed = outcome is not None and outcome.record.passed
    made = decide(procedure, setup.decision, "", console)
    print_tip_status(console, place.store, procedure.tip, now())
    if made is not ProcedureDecision.ACCEPTED or not passed:
        raise typer.Exit(1)


def _mounted(place: TerminalProbeSite, tip: str | None, who: str, console: PlainConsole) -> str:
    """Return the name of the tip on the probe; naming another tip mounts it."""
    from ocmm_cli.calibrate._run import now

    name = tip or place.store.mounted
    if name is None:
        raise CalibrationError(
            "probe_record.none",
            f"Probe '{place.body.name}' was never calibrated.",
            "Calibrate it first: ocmm calibrate probe --tip NAME.",
        )
    if name != place.store.mounted:
        place.store.mount(name, who, now())
        console.print(f"{lead('Mounted  ')}{name}")
    return name


def _record_missing(
    procedure: TipQualificationProcedure | TipCheckProcedure,
    place: TerminalProbeSite,
    shots: Path | None,
    spot: TableOptions,
    setup: ProbeSetup,
    console: PlainConsole,
) -> None:
    """Add missing observations from a file or the cameras, print them, and compute."""
    from ocmm_cli.calibrate import _steps as steps
    from ocmm_cli.calibrate._tip_report import print_cone, print_sphere
    from ocmm_core.calibration.guided import load_shots

    site = place.site
    if shots is not None:
        recorded = load_shots(shots, site.rig, place.body.n_leds, spot)
        print_table_account(recorded.account)
        take_tip_shots(procedure, recorded.shots)
        steps.require_end(procedure)
    elif steps.is_lacking(procedure):

        def scenes(sim: Any, _virtual: VirtualSite) -> tuple[Scene, ...]:
            from ocmm_sim.calibration_scenes import TipFault

            fault = TipFault(**_FAULTS[setup.scene])
            view, sphere = procedure.view, procedure.sphere
            return (sim.scene_of_tip(view, sphere, site.rig, setup.seed, fault),)

        steps.collect_from(
            procedure, site, setup, setup.probe, scenes, console, cameras=place.cameras
        )
    print_sphere(console, procedure.view)
    print_cone(console, procedure.view)
    procedure.compute()


def take_tip_shots(
    procedure: TipQualificationProcedure | TipCheckProcedure, shots: Sequence[Shot]
) -> None:
    """Add shots that a session lacks, sphere then cone; CalibrationError if out of sequence."""
    from ocmm_cli.calibrate._run import now
    from ocmm_core.calibration.tip import CONE, SPHERE

    view = procedure.view
    left = {SPHERE: len(view.sphere.tips_world), CONE: len(view.cone.tips_world)}
    if procedure.base.step.name not in (SPHERE, CONE):
        procedure.advance(now())
    for shot in shots:
        if left.get(shot.kind, 0) > 0:
            left[shot.kind] -= 1
            continue
        # All points of the file count, also surplus ones.
        if shot.kind == CONE and procedure.base.step.name == SPHERE:
            procedure.advance(now())
        if shot.kind != procedure.base.step.name:
            raise CalibrationError(
                "calibrate.shots",
                f"The recorded shots contain one of kind '{shot.kind}', which does not belong "
                f"in step '{procedure.base.step.title}'.",
                "Give the shots of the sphere, then those in the cone.",
            )
        procedure.take_shot(shot.uv, shot.sigma_px, now())


def _cone(text: str) -> ArtefactUse | None:
    from ocmm_core.calibration.records import ArtefactUse

    if not text.strip():
        return None
    return ArtefactUse(
        name=text.strip(), serial="", certificate="", certificate_sha256="", due_utc=""
    )
