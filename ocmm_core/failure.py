"""Boundary for unexpected errors in every thread, process and command.

An `OcmmError` passes unchanged; any other exception is a defect and becomes an `InternalError`
whose remedy names the file with its traceback.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import itertools
import os
import platform
import sys
import threading
import traceback
import unicodedata
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import NoReturn, TextIO

from ocmm_core import __version__
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InternalError, OcmmError

_SPELLED = {
    "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "µ": "u", "μ": "u",
    "±": "+/-", "°": "deg", "²": "^2", "×": "x", "·": "*", "…": "...", "–": "-", "−": "-", "Ø": "O",
    "„": '"', "“": '"', "”": '"', "‘": "'", "’": "'", "⌀": "D", "█": "#",  # noqa: RUF001
}  # fmt: skip
"""Spelling of the signs in messages if the encoding of a terminal lacks them."""
_HANDLER = "ocmm.spelled"


def print_in_any_encoding() -> None:
    """Let standard output and errors spell signs that their encoding lacks (``µm`` is ``um``).

    Other characters are shown as numbers, so that no text becomes another one.
    """
    codecs.register_error(_HANDLER, _spelled)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_HANDLER)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_sign(one) for one in error.object[error.start : error.end]), error.end


def _sign(one: str) -> str:
    if unicodedata.category(one) == "Zs":
        return " "
    return _SPELLED.get(one, one.encode("ascii", "backslashreplace").decode("ascii"))


EXIT_FAILED = 2
"""Exit code of a program that ends with a sentence."""
EXIT_INTERNAL = 3
"""Exit code of every command that met the unexpected."""
INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 + SIGINT."""

CODE = "internal.failure"
REOPEN = "Open the job again."
"""Remedy of what fails while a job is measured."""
AGAIN = "Try again."
"""Remedy of everything else."""
MOST_LOGS = 50
"""Older log files of failures are removed."""
_LONGEST_MESSAGE = 200

_numbers = itertools.count(1)


def contained(error: BaseException, part: str, safe: str = "", remedy: str = AGAIN) -> OcmmError:
    """Return the message of an exception; the traceback of an unexpected one is stored in a file.

    Never raises. ``part``: failed part, at the start of a sentence, "The reconstruction"; ``safe``:
    sentence on what is not lost, may be empty; ``remedy``: `REOPEN` while measuring.
    """
    told = described(error, part, safe, remedy)
    if not isinstance(told, InternalError) or told is cause_of(error):
        return told
    return InternalError(told.code, told.what, f"{told.remedy} {_kept(error, part)}")


def described(error: BaseException, part: str, safe: str = "", remedy: str = AGAIN) -> OcmmError:
    """Return the message of an exception as `contained`, without writing a file."""
    cause = cause_of(error)
    if isinstance(cause, OcmmError):
        return cause
    what = f"{part} failed: {_named(cause)}{_place(cause)}."
    return InternalError(CODE, what, f"{safe} {remedy}".strip())


def cause_of(error: BaseException) -> BaseException:
    """Return the exception of a signal's listener, or the exception itself."""
    # Not loaded here: a help text would take longer.
    signals = sys.modules.get("psygnal")
    if signals is None:
        return error
    while isinstance(error, signals.EmitLoopError) and error.__cause__ is not None:
        error = error.__cause__
    return error


def log_folder() -> Path:
    """Return the folder of the log files of failures."""
    import platformdirs

    return platformdirs.user_log_path("ocmm")


def hold_standard_streams() -> None:
    """Replace closed standard streams by the null device; let the others print any character.

    Otherwise the next opened file, e.g. a job, gets the number of a closed stream and its output.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, os.O_RDWR)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
        if getattr(sys, name) is None:
            mode = "w" if number else "r"
            stream = os.fdopen(number, mode, encoding="utf-8", errors="replace", closefd=False)
            setattr(sys, name, stream)
    print_in_any_encoding()


def silence(stream: TextIO) -> None:
    """Drop unwritable output, which would end Python with code 120."""
    with contextlib.suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, stream.fileno())
        os.close(nothing)
        stream.flush()


def write_last(text: str = "") -> None:
    """Write the last words of a process; if they cannot be written, its exit code remains."""
    with contextlib.suppress(OSError):
        sys.stderr.write(text)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            silence(stream)


def exit_with(error: Exception, part: str, remedy: str = AGAIN) -> NoReturn:
    """End this process with the message of an exception; see `contained`."""
    told = contained(error, part, remedy=remedy)
    write_last(f"{told}\n")
    sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED)


class ThreadNet:
    """Catch exceptions of threads without a boundary; ``tell`` gets each message there."""

    def __init__(self, tell: Callable[[OcmmError], None]) -> None:
        self._tell = tell
        self._previous = threading.excepthook
        self.caught: list[OcmmError] = []

    def __enter__(self) -> ThreadNet:
        self._previous = threading.excepthook
        threading.excepthook = self._on_error
        return self

    def __exit__(self, *_: object) -> None:
        threading.excepthook = self._previous

    def _on_error(self, args: threading.ExceptHookArgs) -> None:
        if args.exc_value is None:
            return
        name = args.thread.name if args.thread is not None else "unknown"
        told = contained(args.exc_value, f"The thread {name}")
        self.caught.append(told)
        self._tell(told)


def _named(error: BaseException) -> str:
    """Return type and message of an exception on one line."""
    try:
        message = " ".join(str(error).split())
    except Exception:
        message = "its message cannot be read"
    if len(message) > _LONGEST_MESSAGE:
        message = f"{message[: _LONGEST_MESSAGE - 3]}..."
    name = type(error).__name__
    return f"{name}: {message.rstrip('.')}" if message else name


def _place(error: BaseException) -> str:
    """Return file and line that raised, the innermost one of this program if any."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "ocmm_" in frame.filename]
    if not frames:
        return ""
    frame = (own or frames)[-1]
    return f" ({Path(frame.filename).name}, line {frame.lineno})"


def _kept(error: BaseException, part: str) -> str:
    """Write the traceback into a file and return a sentence that names it."""
    try:
        folder = log_folder()
        folder.mkdir(parents=True, exist_ok=True)
        now = datetime.now(UTC)
        path = folder / f"failure-{now:%Y%m%dT%H%M%S%f}-{os.getpid()}-{next(_numbers)}.log"
        head = (
            f"{now.isoformat()} {part} failed\n"
            f"ocmm {__version__}, Python {platform.python_version()}, {platform.platform()}, "
            f"process {os.getpid()}, thread {threading.current_thread().name}\n\n"
        )
        text = head + "".join(traceback.format_exception(error))
        write_atomic(path, text.encode("utf-8", errors="replace"))
        for old in sorted(folder.glob("failure-*.log"))[:-MOST_LOGS]:
            old.unlink(missing_ok=True)
    except Exception as fault:
        return f"The log could not be written ({_named(fault)})."
    return f"Log for support: {path}"
