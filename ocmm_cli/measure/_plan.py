"""``ocmm plan``: check, create, release and export plans."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.measure._offers import print_requirements
from ocmm_cli.measure._plan_import import (
    empty_plan,
    import_command,
    print_findings,
    require_free,
    write_plan,
)
from ocmm_cli.terminal import make_console, say

if TYPE_CHECKING:
    from ocmm_core.inspection.plan import Plan


plan_app = typer.Typer(no_args_is_help=True, help="Check, create and import plans.")
plan_app.command(name="import")(import_command)


@plan_app.command()
def check(plan: Path) -> None:
    """Check a plan: contradictions, its release, requirements left out, pictures and sizes.

    Code 1: the plan has errors, such as a nominal that its feature contradicts or limits that are
    not yet set. It cannot be released or measured before they are corrected.
    """
    from ocmm_core.inspection.plan import load_plan, plan_release, requirement_count

    loaded = load_plan(plan)
    errors = print_findings(loaded)
    console = make_console()
    n_features, n_made = len(loaded.features), len(loaded.constructions)
    n_points = sum(feature.points for feature in loaded.features)
    n_wanted = len(loaded.characteristics)
    features = say(f"{n_features:d} feature{'' if n_features == 1 else 's'}")
    points = say(f"{n_points:d} point{'' if n_points == 1 else 's'}")
    constructions = say(f"{n_made:d} construction{'' if n_made == 1 else 's'}")
    characteristics = say(f"{n_wanted:d} characteristic{'' if n_wanted == 1 else 's'}")
    count = requirement_count(loaded)
    if errors:
        words = say(f"{plan}: not valid, {errors} error{'' if errors == 1 else 's'}.")
    elif count is not None and not count.is_whole:
        words = say(
            f"{plan}: partial. {features} with {points}, {constructions}, {characteristics}."
        )
    else:
        words = say(f"{plan}: good. {features} with {points}, {constructions}, {characteristics}.")
    console.print(words, highlight=False, markup=False)
    print_requirements(count, console)
    console.print(
        say(f"Plan release: {say(plan_release(plan).words)}."), highlight=False, markup=False
    )
    for warning in warnings_of(loaded, plan.parent):
        console.print(say(warning), style="yellow", highlight=False)
    if errors:
        raise typer.Exit(1)


@plan_app.command()
def account(plan: Path, output: Path, overwrite: bool) -> None:
    """Write the requirements of the imported files with balloon numbers, as an inspection plan.

    Each requirement is in the plan, with its characteristics, or left out, with the reason.
    """
    from ocmm_core.export.report import write_account
    from ocmm_core.inspection.plan import load_plan, requirement_count

    loaded = load_plan(plan)
    require_free(output, overwrite=overwrite)
    write_account(loaded, output)
    console = make_console()
    console.print(str(output), highlight=False, markup=False)
    print_requirements(requirement_count(loaded), console)


@plan_app.command()
def release(plan: Path, who: str, reason: str) -> None:
    """Release a plan by name: its release is signed and kept next to it (.release.json).

    Any later change of the plan, e.g. of a limit, voids the release. Jobs contain the release of
    the plan that they were measured by.
    """
    from ocmm_core.inspection.plan import plan_release, release_plan

    release_plan(plan, who, reason)
    make_console(soft_wrap=True).print(
        f"{plan}: {say(plan_release(plan).words)}.", highlight=False, markup=False
    )


@plan_app.command()
def new(output: Path, name: str | None, part: str | None, overwrite: bool) -> None:
    """Make a plan with one plane to begin with; edit it in the window or as text."""
    from ocmm_core.features.shapes import NominalFeature, Shape
    from ocmm_core.inspection.plan import usual_points

    first = NominalFeature(
        name="DATUM_A", shape=Shape.PLANE, points=usual_points(Shape.PLANE), point=(0.0, 0.0, 0.0)
    )
    write_plan(empty_plan(output, name, part, (first,)), output, overwrite=overwrite)


@plan_app.command()
def part(
    plan_file: Path, output: Path, rig: Path | None, up: str, turn: float, overwrite: bool
) -> None:
    """Write the virtual part of a plan: as its nominals say, in the middle of the volume.

    The virtual rig measures it with --part. It takes the same one by itself, upright, for a plan
    that names its CAD model.
    """
    from ocmm_cad.step import up_of
    from ocmm_core.camera import load_rig
    from ocmm_core.composition import RECOMMENDED_RIG
    from ocmm_core.documents import write_atomic
    from ocmm_core.inspection.plan import load_plan
    from ocmm_core.part_model import Placement
    from ocmm_sim.sources import part_as_planned, part_text

    require_free(output, overwrite=overwrite)
    plan = load_plan(plan_file)
    cameras = load_rig(RECOMMENDED_RIG if rig is None else rig)
    made = part_as_planned(plan, plan_file.absolute().parent, cameras, Placement(up_of(up), turn))
    write_atomic(output, part_text(made).encode())
    make_console().print(
        say(f"{output}: {len(made.features)} surface{'' if len(made.features) == 1 else 's'}"),
        highlight=False,
    )


def warnings_of(plan: Plan, folder: Path) -> list[str]:
    """Return warnings: missing entries that a plan can be measured without."""
    from ocmm_core.inspection.evaluation import places_of

    found = [
        say(f"{feature.name}: picture {feature.picture} not found.")
        for feature in plan.features
        if feature.picture and not (folder / feature.picture).is_file()
    ]
    if plan.model is not None and not (folder / plan.model.file).is_file():
        found.append(say(f"CAD model {plan.model.file} not found; the part is not shown."))
    sizeless = [f.name for f in plan.features if not len(places_of(f, f.points).points)]
    if sizeless:
        found.append(
            say(f"No length or width: {', '.join(sizeless)}; no targets are shown for these.")
        )
    if plan.alignment is None:
        found.append(
            say("No alignment: no targets are shown, and features are probed in order only.")
        )
    return found
