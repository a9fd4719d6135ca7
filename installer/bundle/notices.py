"""Gather the licences of everything that is in the package, as the packages themselves bring them.

``python -m installer.bundle.notices BUNDLE FOLDER`` writes a file for each package of
requirements.lock that has a text of its own, for Python, and for the libraries that PyInstaller
took from the system. THIRD_PARTY_LICENCES.md says what else is inside.
"""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
from importlib.metadata import distribution
from pathlib import Path

from installer.locks import RUNTIME, read_lock
from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import InputError

_TEXT = re.compile(r"(licen[cs]e|copying|notice|copyright)", re.IGNORECASE)
_IN_THE_BOOT_LOADER = "pyinstaller"
_COMMON = ("GPL-2", "GPL-3", "LGPL-2.1", "LGPL-3")
"""Of Qt, SOEM and the libraries of compilers; the wheels that hold them name these only."""


def of_packages() -> dict[str, bytes]:
    """Return the texts by the package's name; a package without one is left out."""
    found = {}
    for name in sorted({*read_lock(RUNTIME), _IN_THE_BOOT_LOADER}):
        files = distribution(name).files or ()
        texts = [
            read_bytes(Path(str(file.locate())))
            for file in sorted(files, key=str)
            if _TEXT.search(file.name) and "dist-info" in str(file)
        ]
        if texts:
            found[name] = b"\n\n".join(texts)
    return found


def of_libraries(bundle: Path) -> dict[str, bytes]:
    """Return the texts of Debian packages whose libraries lie in the bundle, by package.

    Raises
    ------
    InputError
        A library came from the system and no package there knows it.
    """
    found = {}
    for library in sorted(bundle.glob("_internal/lib*.so*")):
        if library.is_symlink() or library.name.startswith("libpython"):
            continue
        owner = _owner(library.name)
        if not owner:
            raise InputError(
                "notices.library",
                f"{library.name} is in the bundle, and no package of this system holds it.",
                "Leave it out in installer/bundle/ocmm.spec, or build on Debian or Ubuntu.",
            )
        found[owner] = read_bytes(Path("/usr/share/doc", owner, "copyright"))
    return found


def of_python() -> bytes:
    """Return the licence of Python."""
    for place in (
        Path(sysconfig.get_path("stdlib"), "LICENSE.txt"),
        Path(f"/usr/share/doc/python{sys.version_info[0]}.{sys.version_info[1]}/copyright"),
    ):
        if place.is_file():
            return read_bytes(place)
    raise InputError(
        "notices.python", "The licence of this Python is not beside it.", "Use another Python."
    )


def _owner(library: str) -> str:
    done = subprocess.run(  # noqa: S603 - a name of a file of our own
        ["/usr/bin/dpkg-query", "-S", f"*/{library}"], capture_output=True, text=True, check=False
    )
    names = sorted(line.partition(":")[0] for line in done.stdout.splitlines())
    return names[0] if names else ""


def main(bundle: Path, folder: Path) -> None:
    """Write all of them."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {**of_libraries(bundle), **of_packages(), "python": of_python()}
    for name in _COMMON:
        texts[name] = read_bytes(Path("/usr/share/common-licenses", name))
    for name, text in texts.items():
        write_atomic(folder / f"{name}.txt", text)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
