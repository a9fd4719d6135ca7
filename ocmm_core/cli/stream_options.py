"""Options of the live stream, for the command line and the window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.station.stream_options import StreamOptions, check_stream

StreamOption = Annotated[
    int | None,
    typer.Option(
        "--stream",
        min=0,
        max=65535,
        metavar="PORT",
        help="Give points, the button and poses to other programs, as lines of JSON on this TCP "
        "port (0: a free one). Off without it.",
    ),
]
StreamHostOption = Annotated[
    str,
    typer.Option(
        "--stream-host", help="Address of the stream. Beyond this computer it needs a token."
    ),
]
StreamTokenOption = Annotated[
    Path | None,
    typer.Option(
        "--stream-token",
        help="File whose first line is the token that clients of the stream must send.",
    ),
]


def stream_options(port: int | None, host: str, token_file: Path | None) -> StreamOptions | None:
    """Return how the stream is given, or None where it is off.

    Raises
    ------
    InputError
        The file of the token cannot be read, or the stream would be open to others.
    """
    if port is None:
        return None
    token = ""
    if token_file is not None:
        token = _first_line(token_file)
    options = StreamOptions(host=host, port=port, token=token)
    check_stream(options)
    return options


def _first_line(path: Path) -> str:
    try:
        lines = read_bytes(path).decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(
            "stream.token_file",
            f"{path}: the token has signs that are not ASCII.",
            "Use letters and digits.",
        ) from error
    return lines[0].strip() if lines else ""
