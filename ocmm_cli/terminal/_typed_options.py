"""Options shared by commands: numbers, tables and points, distributed computation.

Numbers are checked by the table of typed numbers. Commands that read tables and points have an
account of the table. Others can compute on many processes or computers.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

from ocmm_cli.terminal._console import make_console
from ocmm_cli.terminal._speech import say
from ocmm_core.cluster import Site
from ocmm_core.errors import InputError
from ocmm_core.tables import TableAccount
from ocmm_core.typed_numbers import NumberField, option_field


def read_typed_numbers(command: Any, name: str) -> None:
    """Make a command and its subcommands read numbers as the fields of the window do.

    Raises KeyError if a numeric option is not in the table.
    """
    for below, one in getattr(command, "commands", {}).items():
        read_typed_numbers(one, f"{name} {below}")
    for option in command.params:
        kind = option.type_descriptor.annotation
        if not {kind, *get_args(kind)} & {int, float}:
            continue
        word = next((one for one in option.opts if one.startswith("--")), option.name)
        field = option_field(name, word)
        if field is None:
            raise KeyError(f"{name} {word}")
        number = int if field.whole else float
        option.min, option.max = number(field.quantity.least), number(field.quantity.most)
        option.process_value = partial(_read, option, field, option.process_value)


def _read(
    option: Any, field: NumberField, process: Callable[..., Any], context: Any, value: Any
) -> Any:
    """Return the value of an option; typed texts are read by its field."""

    def number(text: Any) -> Any:
        if not isinstance(text, str):
            return text
        try:
            return int(field.read(text)) if field.whole else field.read(text)
        except InputError as error:
            what = f"{say(error.what)} {say(error.remedy)}"
            raise typer.BadParameter(what, ctx=context, param=option) from error

    if isinstance(value, (list, tuple)):
        value = type(value)(map(number, value))
    return process(context, number(value))


TableUnitOption = Annotated[
    str, typer.Option("--unit", help="Unit of the lengths in the file, instead of its own: inch.")
]
ColumnsOption = Annotated[
    str,
    typer.Option(
        "--columns", help="Meaning of each column, '-' for one that is not read: name,x,y,z,-."
    ),
]
DecimalOption = Annotated[
    str, typer.Option("--decimal", help="Decimal sign of the file: point or comma.")
]
SkipOption = Annotated[
    str,
    typer.Option("--skip", help="Lines that are not read: 3 for the first three, or 4-9,12-12."),
]


def print_table_account(account: TableAccount) -> None:
    """Print accepted and omitted data of a reader to stderr; an assumed unit in yellow."""
    console = make_console(stderr=True)
    for sentence in account.sentences():
        is_assumed = sentence.startswith("Unit ") and not account.unit_from
        console.print(say(sentence), style="yellow" if is_assumed else "dim", highlight=False)


def _options(
    *,
    scheduler: Annotated[
        str,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Compute on the workers of this Dask scheduler, e.g. tls://server:8786; default: "
            "this computer.",
        ),
    ] = "",
    workers: Annotated[
        int | None,
        typer.Option("--workers", help="Processes of this computer. Default: as it pays."),
    ] = None,
    scheduler_ca: Annotated[
        Path | None,
        typer.Option(
            "--scheduler-ca", help="PEM file: who signed the certificates of the scheduler."
        ),
    ] = None,
    scheduler_cert: Annotated[
        Path | None,
        typer.Option("--scheduler-cert", help="PEM file: certificate of this computer."),
    ] = None,
    scheduler_key: Annotated[
        Path | None, typer.Option("--scheduler-key", help="PEM file: its key.")
    ] = None,
    unencrypted: Annotated[
        bool,
        typer.Option(
            "--unencrypted",
            help="Allow a scheduler without TLS in a network: only where nobody else is in it.",
        ),
    ] = False,
) -> Site:
    """Return where a command computes; InputError if it cannot be used."""
    site = Site(
        scheduler, workers, scheduler_ca, scheduler_cert, scheduler_key, unencrypted=unencrypted,
        dask=True,
    )  # fmt: skip
    site.check()
    return site


def computing(command: Callable[..., None]) -> Callable[..., None]:
    """Replace the ``site`` parameter of a command with the options for distributed computation.

    The command has the keyword parameter ``site: Site`` and is called with a usable site. Typer
    reads the signature of the returned function.
    """
    own = inspect.signature(command, eval_str=True)
    ours = inspect.signature(_options, eval_str=True).parameters

    @functools.wraps(command)
    def run(**given: object) -> None:
        where = {name: given.pop(name) for name in ours if name in given}
        command(**given, site=_options(**where))  # type: ignore[arg-type]

    parameters: list[inspect.Parameter] = []
    for parameter in own.parameters.values():
        parameters += ours.values() if parameter.name == "site" else [parameter]
    run.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run
