"""Site of a computation: this process, local processes, or a scheduler's workers."""

from __future__ import annotations

import importlib.util
import ipaddress
import os
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from ocmm_core.cluster._sentences import bad_address, no_certificates, no_dask, not_protected


@dataclass(frozen=True, slots=True)
class Site:
    scheduler: str = ""
    """``tls://HOST:PORT`` or ``tcp://HOST:PORT`` of a Dask scheduler; empty: this computer."""
    workers: int | None = None
    """Local processes; None for one per core if it pays. Unused with a scheduler."""
    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None
    """`ca`, `cert`, `key`: PEM files for ``tls``: authority, certificate, key of this computer."""
    unencrypted: bool = False
    """Allow a networked scheduler without TLS."""
    dask: bool = False
    """Local processes may be Dask's if installed and worthwhile; else they are our own, which start
    sooner and do not retry the task of a process that ended. Scripts that set it guard their main
    module, as for `multiprocessing`."""

    def check(self) -> None:
        """Raise InputError if the site cannot or must not be used."""
        if not self.scheduler:
            return
        try:
            parts = urlsplit(self.scheduler)
            host, port = parts.hostname or "", parts.port
        except ValueError:
            raise bad_address(self.scheduler, "cannot be read") from None
        if parts.scheme not in ("tcp", "tls") or not host or port is None:
            raise bad_address(self.scheduler, "is none of tcp://HOST:PORT and tls://HOST:PORT")
        if parts.path or parts.query or parts.fragment or parts.username is not None:
            raise bad_address(self.scheduler, "has more than a host and a port")
        if parts.scheme == "tcp" and not _is_loopback(host) and not self.unencrypted:
            raise not_protected(self.scheduler)
        if parts.scheme == "tls":
            files = {"the CA": self.ca, "a certificate": self.cert, "its key": self.key}
            for what, path in files.items():
                if path is None:
                    raise no_certificates(what)
                if not path.is_file() or not os.access(path, os.R_OK):
                    raise no_certificates(f"{what}, but {path} cannot be read")
        if not has_dask():
            raise no_dask()


HERE = Site()


def has_dask() -> bool:
    """Return whether the extra `shop` is installed, without loading it."""
    return all(importlib.util.find_spec(name) is not None for name in ("dask", "distributed"))


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
