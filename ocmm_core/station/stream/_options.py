"""Address and access of the live stream."""

from __future__ import annotations

import ipaddress
import ssl
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError

SHORTEST_TOKEN = 16


@dataclass(frozen=True, slots=True)
class StreamOptions:
    host: str = "127.0.0.1"
    port: int = 0
    """`host`, `port`: Address to listen on; port 0 selects a free one."""
    token: str = ""
    """Required from clients unless ``host`` is loopback."""
    poses_hz: float = 60.0
    """Maximum rate of poses, and of checks for state changes."""
    certificate: Path | None = None
    private_key: Path | None = None
    """`certificate`, `private_key`: PEM files for TLS; None for plain TCP."""


def check_stream(options: StreamOptions) -> None:
    """Raise InputError if the stream would be open to others without a strong token."""
    if not _is_loopback(options.host) and len(options.token) < SHORTEST_TOKEN:
        raise InputError(
            "stream.token",
            f"The stream would be open to anyone who can reach {options.host}.",
            f"Give a token of {SHORTEST_TOKEN} characters or more, or listen on 127.0.0.1.",
        )


def tls_context(options: StreamOptions) -> ssl.SSLContext | None:
    """Return the TLS context, or None; InputError: missing, unreadable, mismatched or expired."""
    certificate, private_key = options.certificate, options.private_key
    if certificate is None and private_key is None:
        return None
    if certificate is None or private_key is None:
        raise InputError(
            "stream.tls",
            "TLS needs both a certificate and its private key.",
            "Give both together (Settings, Live stream).",
        )
    _require_in_date(certificate)
    read_bytes(private_key)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        # Otherwise OpenSSL would ask for a password on the terminal.
        context.load_cert_chain(certificate, private_key, password="")
    except (ssl.SSLError, OSError, ValueError) as error:
        raise InputError(
            "stream.tls_files",
            f"{certificate} and {private_key} cannot be used for TLS ({error}).",
            "Give a certificate and its own private key without a password, both as PEM files.",
        ) from error
    return context


def _require_in_date(path: Path) -> None:
    from cryptography import x509

    content = read_bytes(path)
    try:
        certificate = x509.load_pem_x509_certificate(content)
    except ValueError as error:
        raise InputError(
            "stream.certificate",
            f"{path}: this is not a certificate ({error}).",
            "Give a PEM file that begins with BEGIN CERTIFICATE.",
        ) from error
    now, end = datetime.now(UTC), certificate.not_valid_after_utc
    if not certificate.not_valid_before_utc <= now <= end:
        raise InputError(
            "stream.certificate_date",
            f"{path}: the certificate is valid from {certificate.not_valid_before_utc:%Y-%m-%d} "
            f"to {end:%Y-%m-%d}.",
            "Renew it.",
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
