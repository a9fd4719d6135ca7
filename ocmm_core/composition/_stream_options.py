"""Options of the live stream from names and numbers."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.station.stream import StreamOptions, check_stream


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
            f"{path}: the token has non-ASCII characters.",
            "Use letters and digits.",
        ) from error
    return lines[0].strip() if lines else ""
