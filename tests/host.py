"""Abilities of the host: the only place in which a test may become NOT RUN.

A test queries them before it begins. A later fault is a failure, never a reason to skip the test.
Each function ends the test as NOT RUN with its reason if the host lacks the ability. The number of
repetitions of a test also comes from here: see `amount`.
"""

from __future__ import annotations

import errno
import importlib.util
import math
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NoReturn

import pytest

HANG_S = 240.0
"""A longer silence is a hang; a busy computer takes ten times the time of an idle one. Less than
pytest's own limit (`timeout` in pyproject.toml), so that the test can report the missing event."""
HANG_MS = int(1000 * HANG_S)
BUSY = 20.0
"""Factor for promised times. The promise is meant for an idle computer, and its figure is printed
or in a benchmark; a test only distinguishes answers from hangs."""

LONG, AGAIN = "OCMM_TEST_LONG", "OCMM_TEST_AGAIN"
"""Set by `./run test --long`, and where tests run once more as another processor."""

on_linux_only = pytest.mark.skipif(sys.platform != "linux", reason="this is no Linux")


def long_form() -> bool:
    """Whether tests take all the time that they want: `./run test --long`."""
    return os.environ.get(LONG, "") not in ("", "0")


def amount(short: int, long: int, again: int | None = None) -> int:
    """Return the number of repetitions of a test; its statement must hold for each of them.

    Parameters
    ----------
    short
        In every run: enough to reveal a broken change.
    long
        In the long form: the number behind the statement.
    again
        If the same run tries `short` on the processor of this computer, and this is another one;
        the default is `short`.
    """
    if long_form():
        return long
    repeated = os.environ.get(AGAIN, "") not in ("", "0")
    return again if repeated and again is not None else short


def looser(tolerance: float, n: int, long: int) -> float:
    """Return a tolerance that was derived from the scatter of ``long`` draws, for ``n`` of them."""
    return tolerance * math.sqrt(long / n)


def not_run(reason: str) -> NoReturn:
    """End the test: this host lacks a requirement."""
    pytest.skip(reason)


def needs_tools(*names: str) -> None:
    """Need programs of the system."""
    for name in names:
        if shutil.which(name) is None:
            not_run(f"'{name}' is not installed")


def needs_package(name: str, why: str) -> None:
    """Need a Python package that is not one of the product's own."""
    if importlib.util.find_spec(name) is None:
        not_run(f"the package '{name}' is not installed ({why})")


def needs_postgresql() -> Path:
    """Need the programs of a PostgreSQL server, and a user it may run as; return their folder."""
    found = postgresql_tools()
    if isinstance(found, str):
        not_run(found)
    return found


def postgresql_tools() -> Path | str:
    """Return the folder of the programs of a PostgreSQL server, or why it cannot be run."""
    # Debian keeps one folder a version, and none of them in the path.
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=_version_of, reverse=True)
    found = next((folder for folder in folders if (folder / "initdb").is_file()), None)
    if found is None:
        return "PostgreSQL is not installed (Debian: apt-get install postgresql)"
    if os.geteuid() == 0:
        if shutil.which("setpriv") is None:
            return "'setpriv' is not installed, and a server refuses to run as root"
        if _complaint(("getent", "passwd", "postgres")):
            return "there is no user 'postgres', and a server refuses to run as root"
    return found


def _version_of(folder: Path) -> float:
    try:
        return float(folder.parent.name)
    except ValueError:
        return 0.0


def needs_root(why: str) -> None:
    """Need to be root."""
    if os.geteuid() != 0:
        not_run(f"only root can {why}")


def private_network() -> list[str]:
    """Return the product's own command prefix for a private network, if this host supports them.

    A private network that exists but is not found by the product is an error of the product, and is
    raised.
    """
    lacking = _lacking_network()
    if lacking:
        not_run(lacking)
    # The tests' set-up imports this file before it limits the linear algebra to one thread, and
    # this import would load it.
    from ocmm_core.fieldbus.wire import namespace_command

    return namespace_command()


def private_mounts() -> list[str]:
    """Return a command prefix for mounts invisible to other processes."""
    prefix = ["unshare", "--user", "--map-root-user", "--mount"]
    lacking = _complaint((*prefix, "true"))
    if lacking:
        not_run(f"no private mounts on this host: {lacking}")
    return prefix


def forbids_file_rights(error: OSError) -> bool:
    """Whether a file system answered that no rights can be attached to files, or not by us."""
    return error.errno in (errno.EPERM, errno.ENOTSUP)


@cache
def _lacking_network() -> str:
    """Return the reason why a private network or virtual cable is impossible; empty if possible.

    Tested with the system's own tools, so that an error of the product is not attributed to the
    host.
    """
    if sys.platform != "linux":
        return "no private networks on this host: this is no Linux"
    cable = ("ip", "link", "add", "near", "type", "veth", "peer", "name", "far")
    lacking = ""
    for way in (("-n",), ("-r", "-n")):
        lacking = _complaint(("unshare", *way, *cable))
        if not lacking:
            return ""
    return f"no virtual cable in a private network on this host: {lacking}"


def _complaint(command: tuple[str, ...]) -> str:
    """Return the complaint of a system tool that fails; empty if it succeeds."""
    folders = f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin:/usr/bin:/bin"
    program = shutil.which(command[0], path=folders)
    if program is None:
        return f"'{command[0]}' is not installed"
    done = subprocess.run(
        [program, *command[1:]], capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "PATH": folders},
    )  # fmt: skip
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"'{command[0]}' ended with {done.returncode}"
