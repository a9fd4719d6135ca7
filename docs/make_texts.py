"""Write the sentences of the window to the files that Qt Linguist translates, and compile those.

``python -m docs.make_texts`` runs Qt's ``lupdate`` over ``ocmm_gui`` and the table of settings for
every language in ``resources/i18n``, which keeps its translations, then ``lrelease``.
``python -m docs.make_texts FILE.ts`` writes another file alone.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

LUPDATE = str(Path(sys.executable).with_name("pyside6-lupdate"))
LRELEASE = str(Path(sys.executable).with_name("pyside6-lrelease"))
"""Both come with PySide6, next to Python."""

_CORE = ("ocmm_core/settings/_specs.py",)
"""Sentences of the core that the window shows as they are, marked with `later`."""


def languages() -> list[Path]:
    """Return the files of all languages."""
    return sorted((ROOT / "resources" / "i18n").glob("*.ts"))


def extract(target: Path, program: str = LUPDATE) -> str:
    """Write or renew ``target`` and return what the program says about it.

    Raises
    ------
    CalledProcessError
        The program failed.
    ValueError
        It warned: some sentence may be missing.
    """
    sources = sorted((ROOT / "ocmm_gui").rglob("*.py"))
    sources += [path for name in _CORE if (path := ROOT / name).exists()]
    done = subprocess.run(  # noqa: S603  # a program of PySide6, with files of ours
        [
            program,
            # `later` marks what `tr` translates when it is used (`ocmm_gui.kit`).
            "-tr-function-alias", "QT_TR_NOOP+=later",
            # Line numbers would change the file with every change of the sources.
            "-locations", "none",
            "-no-obsolete",
            *map(str, sources),
            "-ts", str(target),
        ],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    if done.stderr:
        raise ValueError(done.stderr)
    return done.stdout


def compiled(source: Path, target: Path, program: str = LRELEASE) -> str:
    """Compile the translations of ``source`` for Qt and return the program's messages."""
    done = subprocess.run(  # noqa: S603  # a program of PySide6, with files of ours
        [program, str(source), "-qm", str(target)], check=True, capture_output=True, text=True,
    )  # fmt: skip
    return done.stdout


def main() -> None:
    """Renew the named file, or all languages and their compiled forms."""
    if len(sys.argv) > 1:
        sys.stdout.write(extract(Path(sys.argv[1])))
        return
    for path in languages():
        sys.stdout.write(extract(path))
        sys.stdout.write(compiled(path, path.with_suffix(".qm")))


if __name__ == "__main__":
    main()
