"""Another user, who has no rights, and a Python environment that he may run."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host import needs_root, needs_tools, not_run, private_network

NOBODY = 65534


def as_nobody(*command: str | Path, drop: str = "", number: int = NOBODY) -> list[str]:
    """Return the command as a user without rights; ``drop`` can never be had, not even by file."""
    limits = [f"--bounding-set=-{drop}"] if drop else []
    # setpriv may start any program, so the unprivileged shell starts it.
    return [
        "setpriv", f"--reuid={number}", f"--regid={number}", "--clear-groups", *limits, "--",
        "sh", "-c", 'exec "$0" "$@"', *map(str, command),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def environment() -> Iterator[Path]:
    """Return a Python environment executable by every user, with the packages of this one."""
    needs_root("become another user")
    needs_tools("setpriv", "setcap", "findmnt")
    if "-r" in private_network():
        not_run("root itself may make no private network on this host")
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    # An interpreter below a home folder cannot be reached by others.
    bases = (f"{sys.base_prefix}/bin/{version}", f"/usr/bin/{version}")
    base = next((b for b in bases if subprocess.call(as_nobody("test", "-x", b)) == 0), None)
    if base is None:
        not_run(f"there is no {version} that another user may run")
    if subprocess.call(as_nobody("test", "-r", Path(__file__))) != 0:
        not_run("another user cannot read this checkout")
    folder = Path(tempfile.mkdtemp(prefix="ocmm-rights-"))
    try:
        folder.chmod(0o755)
        subprocess.run([base, "-m", "venv", "--without-pip", str(folder / "venv")], check=True)
        packages = next(path for path in sys.path if path.endswith("site-packages"))
        (folder / "venv" / "lib" / version / "site-packages" / "these.pth").write_text(
            f"import site; site.addsitedir({packages!r})\n", encoding="utf-8"
        )
        python = folder / "venv" / "bin" / "python"
        if subprocess.call(as_nobody(python, "-I", "-c", "import ocmm_core, numpy, pysoem")) != 0:
            not_run("another user cannot import the packages of this environment")
        yield folder / "venv"
    finally:
        shutil.rmtree(folder)
