"""Options of the commands that can compute on many processes or computers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.cluster import Site

SchedulerOption = Annotated[
    str,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Compute on the workers of this Dask scheduler, e.g. tls://server:8786; default: "
        "this computer.",
    ),
]

WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", min=1, help="Processes of this computer. Default: as it pays."),
]

SchedulerCaOption = Annotated[
    Path | None,
    typer.Option("--scheduler-ca", help="PEM file: who signed the certificates of the scheduler."),
]

SchedulerCertOption = Annotated[
    Path | None, typer.Option("--scheduler-cert", help="PEM file: certificate of this computer.")
]

SchedulerKeyOption = Annotated[
    Path | None, typer.Option("--scheduler-key", help="PEM file: its key.")
]

UnencryptedOption = Annotated[
    bool,
    typer.Option(
        "--unencrypted",
        help="Allow a scheduler without TLS in a network: only where nobody else is in it.",
    ),
]


def site_of(
    scheduler: str,
    workers: int | None,
    files: tuple[Path | None, Path | None, Path | None],
    *,
    unencrypted: bool,
) -> Site:
    """Return where a command computes; ``files`` are CA, certificate and key."""
    site = Site(scheduler, workers, *files, unencrypted=unencrypted, dask=True)
    site.check()
    return site
