"""Options and file writing shared by the commands of ``ocmm bus``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_cli.terminal import make_console, say
from ocmm_core.composition import source_help, sources
from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError

BusOption = Annotated[
    str, typer.Option("--source", help=source_help([spec for spec in sources() if spec.on_bus]))
]
CameraArgument = Annotated[str, typer.Argument(help="Name of the camera in the rig.")]


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically and print its path."""
    try:
        write_atomic(path, content)
    except OSError as error:
        raise StorageError(
            "out.file",
            f"{path}: cannot be written ({error.strerror}).",
            "Give a file in a folder that exists and that you may write to.",
        ) from error
    make_console().print(say(f"{path}: {len(content)} bytes"), highlight=False)
