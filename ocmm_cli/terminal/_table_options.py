"""Options of commands that read tables and points, and their table account."""

from __future__ import annotations

from typing import Annotated

import typer

from ocmm_cli.terminal._console import make_console
from ocmm_cli.terminal._speech import say
from ocmm_core.tables import TableAccount

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
