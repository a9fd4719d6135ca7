"""Entry of ``ocmm``: every fault becomes a sentence and an exit code."""

from __future__ import annotations

import contextlib
import errno
import gc
import os
import stat
import sys
from typing import NoReturn, TextIO

from ocmm_cli.terminal import tr
from ocmm_core import failure
from ocmm_core.acquisition.bus_process import hold_nothing
from ocmm_core.blas import use_one_thread
from ocmm_core.errors import InputError, InternalError, OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.side_files import distrust_working_folder

COULD_NOT_MEASURE = 2
NOBODY_READS = 141
"""128 + SIGPIPE, as of other programs whose reader has gone: ``ocmm --help | head -1``."""

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG, errno.EBADF)

_SAFE = "All points taken are saved in the job file."
_MEASURING = ("measure", "demo")
"""Commands that record points in a job file."""


def main() -> None:
    """Run the command line; every fault becomes a sentence and its remedy."""
    failure.hold_standard_streams()
    try:
        _main()
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            sys.exit(_written(end.code or 0))
        raise
    sys.exit(_written(0))


def _main() -> None:
    piped = _is_piped()
    with failure.ThreadNet(_print_error) as threads:
        try:
            _run()
        except SystemExit as end:
            if threads.caught:
                sys.exit(failure.EXIT_INTERNAL)
            cause = end.__context__
            stop = getattr(cause, "__cause__", None)
            if isinstance(stop, KeyboardInterrupt):
                # typer makes an exit of it and says nothing.
                _tell_stopped(stop)
            if end.code == 1 and isinstance(cause, Exception) and type(cause).__name__ != "Exit":
                # typer reports the end of a pipe or file as "aborted", with the code of a
                # nonconforming part.
                _give_up(cause.__cause__ or cause, piped=piped)
            raise
        except KeyboardInterrupt as stop:
            _tell_stopped(stop)
            sys.exit(failure.INTERRUPTED)
        except Exception as error:
            _give_up(error, piped=piped)
        if threads.caught:
            sys.exit(failure.EXIT_INTERNAL)


def _run() -> None:
    # With Python's own threshold, collections take a tenth of the start.
    gc.set_threshold(50_000, 10, 10)
    distrust_working_folder()
    hold_nothing()
    use_one_thread()
    # typer and the packages behind it load slowly; a worker that imports this package by chance
    # must not pay for them.
    from ocmm_cli._app import app

    app()


def _tell_stopped(stop: KeyboardInterrupt) -> None:
    """Print what is kept and how to continue, if known."""
    told = tr("ocmm: stopped.")
    if _measures():
        told = tr("ocmm: stopped; all points taken are saved in the job file.")
    sys.stderr.write(f"{told} {stop}".rstrip() + "\n")


def _give_up(error: BaseException, *, piped: bool) -> NoReturn:
    if isinstance(error, BrokenPipeError) and piped and _is_unread():
        # Nothing failed; suppress the complaint about the unwritten buffer at exit.
        failure.silence(sys.stdout)
        sys.exit(NOBODY_READS)
    if isinstance(error, OSError) and error.errno in _FULL and error.filename is None:
        fault = _fault_of(sys.stdout, b"\n") or _fault_of(sys.stderr, b"\n")
        if fault is not None:
            _print_error(_unwritten(fault))
            sys.exit(COULD_NOT_MEASURE)
    if isinstance(error, ModuleNotFoundError) and (error.name or "").startswith("ocmm_"):
        package = str(error.name).partition(".")[0]
        error = InputError(
            "package.missing",
            f"This command needs the package '{package}', which is not installed.",
            "Install the whole program, or use another source or command.",
        )
    job = _measures()
    told = failure.contained(
        error, "The command", _SAFE if job else "", failure.REOPEN if job else failure.AGAIN
    )
    _print_error(told)
    sys.exit(failure.EXIT_INTERNAL if isinstance(told, InternalError) else COULD_NOT_MEASURE)


def _written(code: int) -> int:
    """Return the exit code after flushing the output, or that of a failed flush."""
    fault = _fault_of(sys.stdout)
    if fault is not None:
        failure.silence(sys.stdout)
        if isinstance(fault, BrokenPipeError):
            code = code or NOBODY_READS
        else:
            code = max(code, COULD_NOT_MEASURE)
            _print_error(_unwritten(fault))
    if _fault_of(sys.stderr) is not None:
        failure.silence(sys.stderr)
    return code


def _unwritten(fault: OSError) -> OcmmError:
    return StorageError(
        "output.unwritable",
        f"The output could not be written ({fault.strerror}).",
        "Free disk space or print to another place, then repeat the command."
        f"{f' {_SAFE}' if _measures() else ''}",
    )


def _fault_of(stream: TextIO, probe: bytes = b"") -> OSError | None:
    """Return why a stream cannot be written; None if it can be, or is closed."""
    try:
        stream.flush()
        if probe:
            os.write(stream.fileno(), probe)
    except OSError as error:
        return error
    except ValueError:
        # Closed.
        return None
    return None


def _measures() -> bool:
    words = iter(sys.argv[1:])
    for word in words:
        if word == "--language":
            next(words, "")
        elif not word.startswith("-"):
            return word in _MEASURING
    return False


def _is_piped() -> bool:
    try:
        return stat.S_ISFIFO(os.fstat(sys.stdout.fileno()).st_mode)
    except (OSError, ValueError):
        return False


def _is_unread() -> bool:
    """Return whether stdout has no reader; rich replaces such a pipe with the null device."""
    if not _is_piped():
        return True
    return HOST.reader_has_left(sys.stdout.fileno())


def _print_error(error: OcmmError) -> None:
    # The exit code remains even if nothing reads the text.
    from ocmm_cli.terminal import shown

    lines = (shown(" ".join(text.split("\n"))) for text in _in_language(error))
    with contextlib.suppress(OSError):
        sys.stderr.write("ocmm: {}\n      {}\n".format(*lines))


def _in_language(error: OcmmError) -> tuple[str, str]:
    """Return the error in the terminal's language; English if translation fails."""
    try:
        from ocmm_cli.terminal import language
        from ocmm_core.wording import in_language

        return in_language(error, language(os.environ))
    except OcmmError:
        return error.what, error.remedy


if __name__ == "__main__":
    main()
