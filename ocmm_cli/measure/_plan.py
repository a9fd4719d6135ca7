"""``ocmm plan``: check, create, release and export plans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import typer

from ocmm_cli.measure import _offers as offers
from ocmm_cli.measure._offers import account_json, plan_rig, print_account, print_requirements
from ocmm_cli.terminal import make_console, print_table_account, tr, tr_word
from ocmm_core.errors import InputError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_core.features.shapes import NominalFeature
    from ocmm_core.inspection.plan import Plan


@dataclass(frozen=True, slots=True)
class PlanDestination:
    """The plan document that an import writes."""

    output: Path | None
    name: str | None
    part: str | None
    overwrite: bool


@dataclass(frozen=True, slots=True)
class SurfaceFilter:
    """Surfaces of a model to import; sizes in mm."""

    only: list[str] | None
    without: list[str] | None
    kind: list[str] | None
    least: float
    most: float


def import_command(
    file: Path, into: PlanDestination, targets: offers.TargetOptions, surfaces: SurfaceFilter,
    profile: float | None, as_list: bool, whole: bool, tolerances: bool, general: str,
    keep_model: bool, as_json: bool, layout: TableOptions,
) -> None:  # fmt: skip
    """Make a plan of the features of a table or of the surfaces of a model.

    Columns of a table: name, shape, x, y, z; and if wanted i, j, k, diameter, length, width, angle,
    side, points, text. Headings may state units (x in inch). The features of a
    model get targets on its trimmed faces, where the probe reaches and the cameras see it while the
    part stands in the middle of the measuring volume; what is left out is told with the reason.
    --list shows what can be chosen. Free forms come with --profile: each as points and the profile
    of its surface against the model, by the datums of the plan, or where it fits best.
    Code 1: the plan is written, and a requirement of the source was refused, or the plan has errors
    that prevent its release and its measurement.
    """
    from ocmm_cad.drawing import (
        NOT_IMPORTED,
        Account,
        general_of,
        plan_with_tolerances,
        with_account,
    )
    from ocmm_cad.profiles import with_profiles
    from ocmm_cad.step import Choice, ask_for_chosen, chosen, faces_account, offers_of, read_model
    from ocmm_core.inspection.plan import feature_table, requirement_count, with_model
    from ocmm_core.part_model import STEP_ENDINGS

    output, overwrite = into.output, into.overwrite
    if output is None and not as_list:
        raise InputError(
            "plan.output", "No plan document to write is named.", "Give --output, or --list."
        )
    if file.suffix.lower() == ".qif":
        if output is None:
            raise InputError("plan.output", "A QIF document is not listed.", "Give --output.")
        _import_qif(
            file, empty_plan(output, into.name, into.part), output, as_json, overwrite=overwrite
        )
        return
    if file.suffix.lower() not in STEP_ENDINGS:
        if output is None:
            raise InputError(
                "plan.list", f"{file}: only a model offers surfaces.", "Give a STEP file."
            )
        table = feature_table(file, layout)
        if not as_json:
            print_table_account(table.account)
        plan = table.added_to(empty_plan(output, into.name, into.part))
        errors = write_plan(plan, output, overwrite=overwrite, silent=as_json)
        if as_json:
            _echo({**_summary(plan, output), "table": table.account.as_json()})
        if errors:
            raise typer.Exit(1)
        return
    general_of(general)
    if output is not None and not as_list:
        require_free(output, overwrite=overwrite)
    model = read_model(file, request=targets.request(), with_part=keep_model and not as_list)
    everything = whole or (as_list and not surfaces.only)
    choice = Choice(
        tuple(surfaces.only or ()), tuple(surfaces.without or ()), tuple(surfaces.kind or ()),
        surfaces.least, surfaces.most, everything, profiles=profile is not None or as_list,
    )  # fmt: skip
    taken = chosen(offers_of(model), choice)
    if output is None or as_list:
        if as_json:
            typer.echo(offers.offers_json(taken, model))
        else:
            offers.print_offers(taken, model, make_console())
        return
    free_forms = [one.free_form for one in taken if one.free_form is not None]
    if free_forms and profile is None:
        raise InputError(
            "plan.no_zone",
            f"{free_forms[0].name} is a free form, and the width of its zone is not known.",
            "Give --profile with the tolerance of the drawing, mm.",
        )
    asked = ask_for_chosen(model, taken)
    faces = faces_account(model, asked.taken, asked.refused)
    taken = asked.taken
    free_forms = [one.free_form for one in taken if one.free_form is not None]
    features = tuple(one.feature for one in taken if one.free_form is None)
    bare = empty_plan(output, into.name, into.part, features)
    plan, account = plan_with_tolerances(bare, model, general)
    reason = "" if tolerances else NOT_IMPORTED
    plan = with_account(plan if tolerances else bare, model, account, file, reason)
    if profile is not None:
        plan = with_profiles(plan, free_forms, profile)
    if keep_model:
        plan = with_model(plan, output, file, model.part)
    errors = write_plan(plan, output, overwrite=overwrite, silent=as_json)
    if as_json:
        found = {
            **_summary(plan, output),
            "faces": faces.faces,
            "faces_taken": faces.taken,
            "left_out": dict(faces.left_out),
            "recognised": dict(faces.recognised),
            "reach": [*filter(None, [model.remark]), *asked.sentences()],
        }
        typer.echo(account_json(account if tolerances else Account(), found))
    else:
        console = make_console()
        offers.print_faces(faces, console)
        for sentence in filter(None, (model.remark, *asked.sentences())):
            console.show(sentence, style="yellow")
        if model.free_forms and not free_forms:
            console.print(offers.free_form_words(model))
        if tolerances:
            print_account(account, console)
        print_requirements(requirement_count(plan), console)
    if errors or (tolerances and not account.is_complete):
        raise typer.Exit(1)


def _import_qif(file: Path, empty: Plan, output: Path, as_json: bool, *, overwrite: bool) -> None:
    """Write the plan of a QIF document; code 1 if items are left out or the plan has errors."""
    from ocmm_core.documents import read_bytes
    from ocmm_core.export.qif import plan_of_qif
    from ocmm_core.inspection.plan import requirement_count

    found = plan_of_qif(read_bytes(file), empty.name, empty.part, file.name)
    errors = write_plan(found.plan, output, overwrite=overwrite, silent=as_json)
    if as_json:
        left_out = [{"name": one.name, "why": one.why} for one in found.left_out]
        _echo({**_summary(found.plan, output), "items_left_out": left_out})
    else:
        console = make_console()
        for one in found.left_out:
            console.print(f"{tr_word('Left out')}: {one.name}: {tr(one.why)}")
        print_requirements(requirement_count(found.plan), console)
    if found.left_out or errors:
        raise typer.Exit(1)


def _echo(content: dict[str, Any]) -> None:
    typer.echo(msgspec.json.format(msgspec.json.encode(content), indent=2).decode())


def _summary(plan: Plan, output: Path) -> dict[str, Any]:
    """Return the size of a plan, the count of requirements and the findings, for JSON."""
    from ocmm_core.inspection.plan import plan_findings, requirement_count

    found = plan_findings(plan)
    return {
        "plan": str(output),
        "features": len(plan.features),
        "characteristics": len(plan.characteristics),
        "requirements": "" if (count := requirement_count(plan)) is None else count.sentence,
        "valid": not any(one.is_error for one in found),
        "findings": [
            {"item": one.item, "error": one.is_error, "what": one.what, "remedy": one.remedy}
            for one in found
        ],
    }


def empty_plan(
    output: Path, name: str | None, part: str | None, features: Sequence[NominalFeature] = ()
) -> Plan:
    """Return a plan with its features; name and part default to the name of the document."""
    from ocmm_core.inspection.plan import new_plan

    empty = new_plan(name or output.stem, part or output.stem)
    return msgspec.structs.replace(empty, features=list(features))


def write_plan(plan: Plan, output: Path, *, overwrite: bool, silent: bool = False) -> int:
    """Write a plan, print its size and findings, and return the number of errors."""
    from ocmm_core.inspection.plan import check_plan, plan_findings, save_plan

    require_free(output, overwrite=overwrite)
    check_plan(output, plan)
    save_plan(plan, output)
    if silent:
        return sum(one.is_error for one in plan_findings(plan))
    count = len(plan.characteristics)
    told = f", {count} characteristic{'' if count == 1 else 's'}" if count else ""
    features = f"{len(plan.features)} feature{'' if len(plan.features) == 1 else 's'}"
    make_console().print(tr(f"{output}: {features}{told}."))
    return print_findings(plan)


def print_findings(plan: Plan) -> int:
    """Print the contradictions of a plan, and return the number of errors."""
    from ocmm_core.inspection.plan import plan_findings

    found = plan_findings(plan)
    for one in found:
        make_console().print(
            f"{'✖' if one.is_error else '▲'} {tr(one.what)} {tr(one.remedy)}",
            style="red" if one.is_error else "yellow",
        )  # fmt: skip
    return sum(one.is_error for one in found)


def require_free(output: Path, *, overwrite: bool) -> None:
    """Raise InputError if a document exists and may not be overwritten."""
    if output.exists() and not overwrite:
        raise InputError(
            "plan.exists",
            f"{output}: this file already exists.",
            "Choose another name, or give --overwrite.",
        )


plan_app: typer.Typer = typer.Typer(no_args_is_help=True, help="Check, create and import plans.")
plan_app.command(name="import")(import_command)
plan_app.command(name="rig")(plan_rig)


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
    features = tr(f"{n_features:d} feature{'' if n_features == 1 else 's'}")
    points = tr(f"{n_points:d} point{'' if n_points == 1 else 's'}")
    constructions = tr(f"{n_made:d} construction{'' if n_made == 1 else 's'}")
    characteristics = tr(f"{n_wanted:d} characteristic{'' if n_wanted == 1 else 's'}")
    count = requirement_count(loaded)
    if errors:
        words = tr(f"{plan}: not valid, {errors} error{'' if errors == 1 else 's'}.")
    elif count is not None and not count.is_whole:
        words = tr(
            f"{plan}: partial. {features} with {points}, {constructions}, {characteristics}."
        )
    else:
        words = tr(f"{plan}: good. {features} with {points}, {constructions}, {characteristics}.")
    console.print(words)
    print_requirements(count, console)
    console.show(f"Plan release: {tr(plan_release(plan).summary)}.")
    for warning in warnings_of(loaded, plan.parent):
        console.show(warning, style="yellow")
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
    console.print(str(output))
    print_requirements(requirement_count(loaded), console)


@plan_app.command()
def release(plan: Path, who: str, reason: str) -> None:
    """Release a plan by name: its release is signed and kept next to it (.release.json).

    Any later change of the plan, e.g. of a limit, voids the release. Jobs contain the release of
    the plan that they were measured by.
    """
    from ocmm_core.inspection.plan import plan_release, release_plan

    release_plan(plan, who, reason)
    make_console(soft_wrap=True).print(f"{plan}: {tr(plan_release(plan).summary)}.")


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
        tr(f"{output}: {len(made.features)} surface{'' if len(made.features) == 1 else 's'}")
    )


def warnings_of(plan: Plan, folder: Path) -> list[str]:
    """Return warnings: missing entries that a plan can be measured without."""
    from ocmm_core.inspection.evaluation import places_of

    found = [
        tr(f"{feature.name}: picture {feature.picture} not found.")
        for feature in plan.features
        if feature.picture and not (folder / feature.picture).is_file()
    ]
    if plan.model is not None and not (folder / plan.model.file).is_file():
        found.append(tr(f"CAD model {plan.model.file} not found; the part is not shown."))
    sizeless = [f.name for f in plan.features if not len(places_of(f, f.points).points)]
    if sizeless:
        found.append(
            tr(f"No length or width: {', '.join(sizeless)}; no targets are shown for these.")
        )
    if plan.alignment is None:
        found.append(
            tr("No alignment: no targets are shown, and features are probed in order only.")
        )
    return found
