"""Access to the second screen: two tokens of one secret, and the address for the reader."""

from __future__ import annotations

import base64
import hashlib
import hmac
import importlib.util
import secrets
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


def new_secret() -> str:
    return secrets.token_urlsafe(24)


@dataclass(frozen=True, slots=True)
class ScreenAccess:
    """Tokens of the page; InputError if a given one is too short.

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
        key = self.secret.encode("utf-8", "surrogatepass")
        found = hmac.new(key, b"ocmm.screen/read", hashlib.sha256).digest()
        return base64.urlsafe_b64encode(found[:18]).decode("ascii")

    def right_of(self, token: str) -> Right:
        """Return what a token permits; the comparison takes equal time for all."""
        given = token.encode("utf-8", "surrogatepass")
        own = self.secret.encode("utf-8", "surrogatepass")
        if hmac.compare_digest(given, self.read_token.encode("ascii")):
            return "read"
        return "control" if hmac.compare_digest(given, own) and self.may_control else ""


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
        """Return the address of the page; the browser never sends the token behind the ``#``."""
        host = _own_address(self.address.host)
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


def _own_address(host: str) -> str:
    """Return an address of this computer that others reach, in place of "all addresses"."""
    if host not in ("0.0.0.0", "::"):  # noqa: S104 - compared, not listened on
        return host
    # Connecting a datagram socket sends nothing; it selects the interface of the default route.
    family, beyond = (
        (socket.AF_INET6, "2001:db8::1") if host == "::" else (socket.AF_INET, "192.0.2.1")
    )
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((beyond, 9))
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])
