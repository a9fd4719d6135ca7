"""Where ``ocmm`` begins and ends: every fault becomes a sentence and an exit code."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from typing import NoReturn

from ocmm_core.acquisition.bus_process import hold_nothing
from ocmm_core.blas import use_one_thread
from ocmm_core.cli.terminal import print_in_any_encoding, say
from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.failure import EXIT_INTERNAL, ThreadNet, contained
from ocmm_core.host import HOST

COULD_NOT_MEASURE = 2
NOBODY_READS = 141
"""128 and SIGPIPE, as of any program whose reader has left: ``ocmm --help | head -1``."""

_SAFE = "All points taken are saved in the job file."
_MEASURING = ("measure", "demo")
"""Commands that record points in a job file."""


def main() -> None:
    """Run the command line; every fault, also one nobody foresaw, is a sentence and its remedy."""
    print_in_any_encoding()
    piped = _is_piped()
    with ThreadNet(_tell) as threads:
        try:
            _run()
        except SystemExit as end:
            if threads.caught:
                sys.exit(EXIT_INTERNAL)
            cause = end.__context__
            if end.code == 1 and isinstance(cause, Exception) and _is_crash(cause):
                # typer calls the end of a pipe or of a file "aborted", with the code of a part
                # that does not conform.
                _give_up(cause.__cause__ or cause, piped=piped)
            raise
        except KeyboardInterrupt:
            if _measures():
                told = say("ocmm: stopped; all points taken are saved in the job file.\n")
            else:
                told = say("ocmm: stopped.\n")
            sys.stderr.write(told)
            sys.exit(130)
        except Exception as error:
            _give_up(error, piped=piped)
        if threads.caught:
            sys.exit(EXIT_INTERNAL)


def _run() -> None:
    hold_nothing()
    use_one_thread()
    # typer and the rooms behind it take a while to load; a worker process that imports this
    # package by chance should not pay for them.
    from ocmm_core.cli._app import app

    app()


def _is_crash(error: Exception) -> bool:
    """Return whether typer ended because of an exception, not because the command said so."""
    return type(error).__name__ != "Exit"


def _give_up(error: BaseException, *, piped: bool) -> NoReturn:
    if isinstance(error, BrokenPipeError) and piped and _is_unread():
        # Nothing failed. What is left in the buffer would be complained about at the very end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(NOBODY_READS)
    told = contained(error, "The command", _SAFE if _measures() else "")
    _tell(told)
    sys.exit(EXIT_INTERNAL if isinstance(told, InternalError) else COULD_NOT_MEASURE)


def _measures() -> bool:
    """Return whether this command records points."""
    return any(word in _MEASURING for word in sys.argv[1:4])


def _is_piped() -> bool:
    """Return whether what is printed goes to another program."""
    try:
        return stat.S_ISFIFO(os.fstat(sys.stdout.fileno()).st_mode)
    except (OSError, ValueError):
        return False


def _is_unread() -> bool:
    """Return whether the program that what is printed went to has left.

    rich puts the null device in the place of a pipe whose reader has left.
    """
    if not _is_piped():
        return True
    return HOST.reader_has_left(sys.stdout.fileno())


def _tell(error: OcmmError) -> None:
    # Where nobody reads it any more, the code still says it.
    from ocmm_core.cli.terminal import shown

    lines = (shown(" ".join(text.split("\n"))) for text in _in_language(error))
    with contextlib.suppress(OSError):
        sys.stderr.write("ocmm: {}\n      {}\n".format(*lines))


def _in_language(error: OcmmError) -> tuple[str, str]:
    """Return the error as whoever reads the terminal wants it; English whatever is wrong there."""
    try:
        from ocmm_core.cli.terminal import language
        from ocmm_core.wording import in_language

        return in_language(error, language(os.environ))
    except OcmmError:
        return error.what, error.remedy


if __name__ == "__main__":
    main()
