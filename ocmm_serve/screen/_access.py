"""Access to the second screen: two tokens of one secret, and the address for the reader."""

from __future__ import annotations

import base64
import hashlib
import hmac
import importlib.util
import socket
from dataclasses import dataclass, field
from typing import Literal

import segno

from ocmm_core.errors import InputError
from ocmm_core.plugins import install_line
from ocmm_core.station.stream import StreamOptions

SHORTEST_TOKEN = 16
Right = Literal["", "read", "control"]
_BLOCKS = {(0, 0): "█", (0, 1): "▀", (1, 0): "▄", (1, 1): " "}


def require_package() -> None:
    """Raise InputError if the package of the server is not installed."""
    if importlib.util.find_spec("aiohttp") is None:
        raise InputError(
            "screen.package",
            "The second screen needs a package that is not installed.",
            f"Install it: {install_line('screen')}.",
        )


@dataclass(frozen=True, slots=True)
class ScreenAccess:
    """Tokens of the page; InputError if the secret is too short.

    The token for reading is derived from the secret by a one-way function: its owner cannot make
    the one for the buttons.
    """

    secret: str = field(repr=False)
    """Token of the page with buttons."""
    may_control: bool = False
    """Whether the secret opens the page with buttons."""

    def __post_init__(self) -> None:
        if len(self.secret) < SHORTEST_TOKEN:
            raise InputError(
                "screen.token",
                f"The token has {len(self.secret)} characters.",
                f"Put {SHORTEST_TOKEN} letters and digits or more into its file.",
            )

    @property
    def read_token(self) -> str:
        found = hmac.new(self.secret.encode(), b"ocmm.screen/read", hashlib.sha256).digest()
        return base64.urlsafe_b64encode(found[:18]).decode("ascii")

    def right_of(self, token: str) -> Right:
        """Return the right of a token; all comparisons take equal time."""
        given = token.encode("utf-8", "surrogatepass")
        if hmac.compare_digest(given, self.read_token.encode()):
            return "read"
        is_secret = hmac.compare_digest(given, self.secret.encode())
        return "control" if is_secret and self.may_control else ""


@dataclass(frozen=True, slots=True)
class ScreenOptions:
    """Options of the server; InputError: buttons in a network without TLS."""

    address: StreamOptions
    access: ScreenAccess

    def __post_init__(self) -> None:
        if self.access.may_control and self.is_exposed:
            raise InputError(
                "screen.control_tls",
                f"Without TLS anyone in the network of {self.address.host} could read the token "
                "and press the buttons.",
                "State the certificate and its key, or serve the page for reading only.",
            )

    @property
    def is_exposed(self) -> bool:
        """Return whether others in the network could read the token."""
        here = self.address.host in ("127.0.0.1", "::1", "localhost")
        return not here and self.address.certificate is None

    def page(self, port: int, token: str) -> str:
        """Return the address of the page; browsers never send the token behind the ``#``."""
        host = self.address.host
        if host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not listened on
            host = socket.gethostname()
        scheme = "http" if self.address.certificate is None else "https"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/#{token}"


def code_lines(text: str) -> tuple[str, ...]:
    """Return a QR code as lines of a terminal, light modules filled; two modules a character."""
    rows = [tuple(row) for row in segno.make(text, micro=False).matrix_iter(border=2)]
    rows += [(0,) * len(rows[0])] * (len(rows) % 2)
    return tuple(
        "".join(_BLOCKS[int(above), int(below)] for above, below in zip(*pair, strict=True))
        for pair in zip(rows[::2], rows[1::2], strict=True)
    )
