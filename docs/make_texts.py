"""Write the sentences of the window to a file that Qt Linguist translates.

``python -m docs.make_texts FILE.ts`` runs Qt's ``lupdate`` over ``ocmm_gui``; a file that is there
keeps its translations.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

LUPDATE = str(Path(sys.executable).with_name("pyside6-lupdate"))
"""Comes with PySide6, beside Python."""


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


def main() -> None:
    """Write the file that is named."""
    sys.stdout.write(extract(Path(sys.argv[1])))


if __name__ == "__main__":
    main()
