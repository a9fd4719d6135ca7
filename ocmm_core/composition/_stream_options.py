"""Options of the live stream."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.host import HOST
from ocmm_core.station.stream import StreamOptions, check_stream, tls_context


def stream_options(
    port: int | None,
    host: str,
    token_file: Path | None,
    certificate: Path | None = None,
    private_key: Path | None = None,
) -> StreamOptions | None:
    """Return the stream options, or None if it is off.

    InputError: the token or key file is unreadable or readable by others, the stream would be open
    to others, or the TLS files are invalid.
    """
    if port is None:
        return None
    token = ""
    if token_file is not None:
        token = _first_line(token_file)
        _require_private(token_file, 0o077, "the token", "a new token")
    options = StreamOptions(
        host=host, port=port, token=token, certificate=certificate, private_key=private_key
    )
    check_stream(options)
    tls_context(options)
    if private_key is not None:
        # A group with access to certificate keys is usual (ssl-cert).
        _require_private(private_key, 0o007, "the key of the certificate", "the key of a new one")
    return options


def _require_private(path: Path, others: int, what: str, renewed: str) -> None:
    """Refuse a secret that other users can read, on systems with file permissions."""
    if HOST.is_open_to(path.stat(), others):
        raise InputError(
            "stream.token_open" if others & 0o070 else "stream.key_open",
            f"{path}: other users of this computer can read {what}.",
            f"Type chmod 600 {path}, and put {renewed} into it.",
        )


_LONGEST_TOKEN_FILE = 65_536


def _first_line(path: Path) -> str:
    try:
        lines = read_bytes(path, _LONGEST_TOKEN_FILE).decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(
            "stream.token_file",
            f"{path}: the token has non-ASCII characters.",
            "Use letters and digits.",
        ) from error
    return lines[0].strip() if lines else ""
