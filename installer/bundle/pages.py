"""Write what the commands say of themselves as man pages, and the completion of shells.

``python -m installer.bundle.pages FOLDER`` fills FOLDER with ``man`` and ``completion``. It is part
of installer/build.sh; the same commands give the same files.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from typer._completion_shared import get_completion_script

from ocmm_core.build import build_version
from ocmm_core.documents import write_atomic

_SHELLS = {"bash": "ocmm", "zsh": "_ocmm", "fish": "ocmm.fish"}
"""By shell: the required name of the file."""


def man_page(app: typer.Typer) -> str:
    """Return the page of ``ocmm``: every command with its options."""
    command = typer.main.get_command(app)
    told = inspect.cleandoc(command.help or "")
    lines = [
        _title("OCMM"), ".SH NAME", f"ocmm \\- {_text(_first(told))}",
        ".SH SYNOPSIS", ".B ocmm", "COMMAND [OPTIONS]", ".SH DESCRIPTION", *_paragraphs(told),
        ".SH COMMANDS", *_commands("ocmm", command), ".SH SEE ALSO", ".BR ocmm-acq (1)",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def bus_page() -> str:
    """Return the page of ``ocmm-acq``."""
    # The program itself, which is never imported.
    program = import_module("ocmm_core.acquisition.bus_process._process")
    told = inspect.cleandoc(program.__doc__ or "")
    used = inspect.cleandoc(program.main.__doc__ or "")
    lines = [
        _title("OCMM-ACQ"), ".SH NAME", "ocmm-acq \\- the camera bus of OCMM",
        ".SH SYNOPSIS", ".B ocmm-acq", "[--interface NAME | CONFIG.json]",
        ".SH DESCRIPTION", *_paragraphs(told), *_paragraphs(used), ".SH SEE ALSO", ".BR ocmm (1)",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def completion(shell: str) -> str:
    """Return the script by which a shell completes the words of ``ocmm``."""
    return get_completion_script(prog_name="ocmm", complete_var="_OCMM_COMPLETE", shell=shell)


def main(folder: Path) -> None:
    """Write all of them."""
    from ocmm_cli import app

    for name, text in (("man/ocmm.1", man_page(app)), ("man/ocmm-acq.1", bus_page())):
        _write(folder / name, text)
    for shell, name in _SHELLS.items():
        _write(folder / "completion" / shell / name, completion(shell) + "\n")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, text.encode("utf-8"))


def _title(name: str) -> str:
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "0")
    date = datetime.fromtimestamp(int(seconds), UTC).date().isoformat()
    return f'.TH {name} 1 "{date}" "OCMM {build_version()}" "User commands"'


def _commands(path: str, command: Any) -> Iterator[str]:
    for name, one in command.commands.items():
        if one.hidden:
            continue
        if hasattr(one, "commands"):
            yield from _commands(f"{path} {name}", one)
            continue
        yield f'.SS "{path} {name}"'
        yield from _paragraphs(inspect.cleandoc(one.help or ""))
        for parameter in one.params:
            told = getattr(parameter, "help", None) or ""
            words = parameter.opts if parameter.param_type_name == "option" else [parameter.name]
            if words == ["--help"] or getattr(parameter, "hidden", False):
                continue
            yield ".TP"
            yield f".B {_text(', '.join(words))}"
            yield _text(told) or "\\&"


def _paragraphs(text: str) -> Iterator[str]:
    for paragraph in re.split(r"\n\s*\n", text):
        yield ".PP"
        yield _text(" ".join(paragraph.split()))


def _first(text: str) -> str:
    return text.split("\n", 1)[0].rstrip(".")


def _text(text: str) -> str:
    """Return text in which nothing is taken for a command of the page."""
    safe = text.replace("\\", "\\e").replace("-", "\\-")
    safe = re.sub(r"``([^`]*)``", r"\1", safe)
    return f"\\&{safe}" if safe[:1] in (".", "'") else safe


if __name__ == "__main__":
    main(Path(sys.argv[1]))
