"""``ocmm plan``: check a plan, make an empty one, import a table or a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ocmm_core.cli.measure import _offers as offers
from ocmm_core.cli.terminal import (
    ColumnsOption,
    DecimalOption,
    SkipOption,
    TableUnitOption,
    make_console,
    print_table_account,
    say,
    say_word,
)
from ocmm_core.errors import InputError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_core.features.shapes import NominalFeature
    from ocmm_core.inspection.plan import Plan
    from ocmm_core.inspection.step import FacesAccount


plan_app = typer.Typer(no_args_is_help=True, help="Check, create and import plans.")


NameOption = Annotated[str | None, typer.Option("--name", help="Name of the plan.")]
PartNameOption = Annotated[str | None, typer.Option("--part", help="Name of the part.")]
OutputOption = Annotated[Path, typer.Option("--output", "-o", help="Plan document to write.")]
OverwriteOption = Annotated[
    bool, typer.Option("--overwrite", help="Overwrite an existing document.")
]


@plan_app.command()
def check(plan: Annotated[Path, typer.Argument(help="Plan document (TOML).")]) -> None:
    """Check a plan: contradictions, its release, requirements left out, pictures and sizes.

    Code 1: the plan has errors, such as a nominal that its feature contradicts or limits that are
    not yet set. It cannot be released or measured before they are corrected.
    """
    from ocmm_core.cli.measure._account import print_requirements
    from ocmm_core.inspection.plan import load_plan, plan_release, requirement_count

    loaded = load_plan(plan)
    errors = _print_findings(loaded)
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
    print_requirements(loaded, console)
    console.print(
        say(f"Plan release: {say(plan_release(plan).words)}."), highlight=False, markup=False
    )
    for warning in warnings_of(loaded, plan.parent):
        console.print(say(warning), style="yellow", highlight=False)
    if errors:
        raise typer.Exit(1)


def _print_findings(plan: Plan) -> int:
    """Print the contradictions of a plan, and return the number of errors."""
    from ocmm_core.inspection.plan import plan_findings

    found = plan_findings(plan)
    for one in found:
        make_console().print(
            f"{'✖' if one.is_error else '▲'} {say(one.what)} {say(one.remedy)}",
            style="red" if one.is_error else "yellow", highlight=False, markup=False,
        )  # fmt: skip
    return sum(one.is_error for one in found)


@plan_app.command()
def account(
    plan: Annotated[Path, typer.Argument(help="Plan document (TOML).")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Inspection plan to write: .csv or .xlsx.")
    ],
    overwrite: OverwriteOption = False,
) -> None:
    """Write the requirements of the imported files with balloon numbers, as an inspection plan.

    Each requirement is in the plan, with its characteristics, or left out, with the reason.
    """
    from ocmm_core.cli.measure._account import print_requirements
    from ocmm_core.documents import write_atomic
    from ocmm_core.export.report import account_file
    from ocmm_core.inspection.plan import load_plan

    loaded = load_plan(plan)
    if not loaded.requirements:
        raise InputError(
            "plan.no_account",
            f"{plan}: the plan has no requirements of a model, QIF document or table.",
            "Import one: ocmm plan import.",
        )
    if output.suffix.lower() not in (".csv", ".xlsx"):
        raise InputError("plan.output", f"{output}: not .csv or .xlsx.", "Give another name.")
    _require_free(output, overwrite=overwrite)
    write_atomic(output, account_file(loaded, output.suffix))
    console = make_console()
    console.print(str(output), highlight=False, markup=False)
    print_requirements(loaded, console)


@plan_app.command()
def release(
    plan: Annotated[Path, typer.Argument(help="Plan document (TOML).")],
    who: Annotated[
        str, typer.Option("--by", help="Name of the person who answers for the limits.")
    ],
    reason: Annotated[str, typer.Option("--reason", help="E.g. the revision of the drawing.")] = "",
) -> None:
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
def new(
    output: OutputOption, name: NameOption = None, part: PartNameOption = None,
    overwrite: OverwriteOption = False,
) -> None:  # fmt: skip
    """Make a plan with one plane to begin with; edit it in the window or as text."""
    from ocmm_core.features.shapes import NominalFeature, Shape
    from ocmm_core.inspection.plan import usual_points

    first = NominalFeature(
        name="DATUM_A", shape=Shape.PLANE, points=usual_points(Shape.PLANE), point=(0.0, 0.0, 0.0)
    )
    _write(_plan((first,), output, name, part), output, overwrite=overwrite)


@plan_app.command(name="import")
def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="Table (CSV), plan or model in QIF 3.0, or model (STEP, needs an extra)."
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Plan document to write.")
    ] = None,
    name: NameOption = None,
    part: PartNameOption = None,
    overwrite: OverwriteOption = False,
    ball: offers.BallOption = None,
    probe: offers.ProbeOption = None,
    rig: offers.RigOption = None,
    up: offers.UpOption = "+z",
    turn: offers.TurnOption = 0.0,
    reach: offers.ReachOption = True,
    sight: offers.SightOption = True,
    only: offers.OnlyOption = None,
    without: offers.WithoutOption = None,
    kind: offers.KindOption = None,
    least: offers.LeastOption = 0.0,
    most: offers.MostOption = float("inf"),
    profile: offers.ProfileOption = None,
    as_list: offers.ListOption = False,
    whole: Annotated[
        bool, typer.Option("--all", help="Of a model: fillets, text and narrow faces too.")
    ] = False,
    tolerances: Annotated[
        bool, typer.Option(help="Of a model (AP242): its tolerances too, with an account of all.")
    ] = True,
    general: Annotated[
        str,
        typer.Option(
            help="General tolerance of sizes and distances of a model without their own: "
            "iso2768-f, -m, -c or -v."
        ),
    ] = "",
    keep_model: Annotated[
        bool,
        typer.Option(
            "--model/--no-model", help="Copy the model beside the plan, so that it is shown."
        ),
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Of a model: what became of it as JSON.")
    ] = False,
    unit: TableUnitOption = "",
    columns: ColumnsOption = "",
    decimal: DecimalOption = "",
    skip: SkipOption = "",
) -> None:
    """Make a plan of the features of a table or of the surfaces of a model.

    Columns of a table: name, shape, x, y, z; and if wanted i, j, k, diameter, length, width, angle,
    side, points, text. Headings may state units ("x [inch]"). The features of a
    model get targets on its trimmed faces, where the probe reaches and the cameras see it while the
    part stands in the middle of the measuring volume; what is left out is told with the reason.
    --list shows what can be chosen. Free forms come with --profile: each as points and the profile
    of its surface against the model, by the datums of the plan, or where it fits best.
    Code 1: the plan is written, and something of the model's tolerances was refused.
    """
    from ocmm_core.cli.measure._account import account_json, print_account, print_requirements
    from ocmm_core.inspection.drawing import (
        NOT_IMPORTED,
        Account,
        general_of,
        plan_with_tolerances,
        with_account,
    )
    from ocmm_core.inspection.plan import feature_table, with_model, with_profiles
    from ocmm_core.inspection.step import (
        STEP_ENDINGS,
        Choice,
        ask_for_chosen,
        chosen,
        faces_account,
        offers_of,
        read_model,
    )

    if output is None and not as_list:
        raise InputError(
            "plan.output", "No plan document to write is named.", "Give --output, or --list."
        )
    if file.suffix.lower() == ".qif":
        if output is None:
            raise InputError("plan.output", "A QIF document is not listed.", "Give --output.")
        _import_qif(file, output, name, part, overwrite=overwrite)
        return
    if file.suffix.lower() not in STEP_ENDINGS:
        if output is None:
            raise InputError(
                "plan.list", f"{file}: only a model offers surfaces.", "Give a STEP file."
            )
        table = feature_table(file, TableOptions(unit, columns, decimal, skip))
        print_table_account(table.account)
        _write(table.added_to(_plan((), output, name, part)), output, overwrite=overwrite)
        return
    general_of(general)
    if output is not None and not as_list:
        _require_free(output, overwrite=overwrite)
    request = offers.request_by(probe, rig, ball, (up, turn), reach=reach, sight=sight)
    model = read_model(file, request=request, with_part=keep_model and not as_list)
    everything = whole or (as_list and not only)
    choice = Choice(
        tuple(only or ()), tuple(without or ()), tuple(kind or ()), least, most, everything,
        profiles=profile is not None or as_list,
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
    surfaces = tuple(one.feature for one in taken if one.free_form is None)
    bare = _plan(surfaces, output, name, part)
    plan, account = plan_with_tolerances(bare, model, general)
    reason = "" if tolerances else NOT_IMPORTED
    plan = with_account(plan if tolerances else bare, model, account, file, reason)
    if profile is not None:
        plan = with_profiles(plan, free_forms, profile)
    if keep_model:
        plan = with_model(plan, output, file, model.part)
    _write(plan, output, overwrite=overwrite, silent=as_json)
    if as_json:
        told = {
            **_told(plan, output, faces),
            "reach": [*filter(None, [model.remark]), *asked.sentences()],
        }
        typer.echo(account_json(account if tolerances else Account(), told))
    else:
        console = make_console()
        offers.print_faces(faces, console)
        for sentence in filter(None, (model.remark, *asked.sentences())):
            console.print(say(sentence), style="yellow", highlight=False)
        if model.free_forms and not free_forms:
            console.print(offers.free_form_words(model), highlight=False)
        if tolerances:
            print_account(account, console)
        print_requirements(plan, console)
    if tolerances and not account.is_complete:
        raise typer.Exit(1)


@plan_app.command()
def part(
    plan_file: Annotated[Path, typer.Argument(metavar="PLAN", help="Plan document.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Document of the part to write.")],
    rig: Annotated[Path | None, typer.Option(help="Cameras; the recommended ones without.")] = None,
    up: offers.UpOption = "+z",
    turn: offers.TurnOption = 0.0,
    overwrite: OverwriteOption = False,
) -> None:
    """Write the virtual part of a plan: as its nominals say, in the middle of the volume.

    The virtual rig measures it with --part. It takes the same one by itself, upright, for a plan
    that names its CAD model.
    """
    from ocmm_core.camera import load_rig
    from ocmm_core.composition import RECOMMENDED_RIG, part_as_planned, part_text
    from ocmm_core.documents import write_atomic
    from ocmm_core.inspection.plan import load_plan
    from ocmm_core.inspection.reach import Placement
    from ocmm_core.inspection.step import up_of

    _require_free(output, overwrite=overwrite)
    plan = load_plan(plan_file)
    cameras = load_rig(RECOMMENDED_RIG if rig is None else rig)
    made = part_as_planned(plan, plan_file.absolute().parent, cameras, Placement(up_of(up), turn))
    write_atomic(output, part_text(made).encode())
    make_console().print(
        say(f"{output}: {len(made.features)} surface{'' if len(made.features) == 1 else 's'}"),
        highlight=False,
    )


def _import_qif(
    file: Path, output: Path, name: str | None, part: str | None, *, overwrite: bool
) -> None:
    """Write the plan of a QIF document, and list its gaps by name; exit code 1 if any."""
    from ocmm_core.cli.measure._account import print_requirements
    from ocmm_core.documents import read_bytes
    from ocmm_core.export.qif import plan_of_qif

    found = plan_of_qif(read_bytes(file), name or output.stem, part or output.stem, file.name)
    _write(found.plan, output, overwrite=overwrite)
    console = make_console()
    for one in found.left_out:
        console.print(
            f"{say_word('Left out')}: {one.name}: {say(one.why)}", highlight=False, markup=False
        )
    print_requirements(found.plan, console)
    if found.left_out:
        raise typer.Exit(1)


def _told(plan: Plan, output: Path, faces: FacesAccount) -> dict[str, Any]:
    from ocmm_core.inspection.plan import requirement_count

    return {
        "plan": str(output),
        "features": len(plan.features),
        "characteristics": len(plan.characteristics),
        "requirements": "" if (count := requirement_count(plan)) is None else count.words,
        "faces": faces.faces,
        "faces_taken": faces.taken,
        "left_out": dict(faces.left_out),
        "recognised": dict(faces.recognised),
    }


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


def _plan(
    features: tuple[NominalFeature, ...], output: Path, name: str | None, part: str | None
) -> Plan:
    from ocmm_core.inspection.plan import new_plan

    empty = new_plan(name or output.stem, part or output.stem)
    return msgspec.structs.replace(empty, features=list(features))


def _write(plan: Plan, output: Path, *, overwrite: bool, silent: bool = False) -> None:
    from ocmm_core.inspection.plan import check_plan, save_plan

    _require_free(output, overwrite=overwrite)
    check_plan(output, plan)
    save_plan(plan, output)
    if not silent:
        count = len(plan.characteristics)
        told = f", {count} characteristic{'' if count == 1 else 's'}" if count else ""
        features = f"{len(plan.features)} feature{'' if len(plan.features) == 1 else 's'}"
        make_console().print(say(f"{output}: {features}{told}."), highlight=False)
        _print_findings(plan)


def _require_free(output: Path, *, overwrite: bool) -> None:
    if output.exists() and not overwrite:
        raise InputError(
            "plan.exists",
            f"{output}: this file already exists.",
            "Choose another name, or give --overwrite.",
        )
