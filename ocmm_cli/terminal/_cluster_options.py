"""Shared options of the commands that can compute on many processes or computers."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.cluster import Site


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
