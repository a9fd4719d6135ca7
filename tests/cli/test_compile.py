"""The set-up compiles all that is listed, and after that nothing is compiled again."""

from __future__ import annotations

from ocmm_cli import compile_all, kernel_groups
from tests.commands import Ocmm


def test_what_is_compiled_is_not_compiled_again(ocmm: Ocmm) -> None:
    """The first run finds or makes the compiled functions; both runs contain every listed one."""
    listed = sum(map(len, kernel_groups()))
    assert listed > 40
    assert compile_all(1).listed == listed
    done = ocmm("compile")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{listed} compiled functions are ready, 0 were compiled now.\n"


def test_no_function_is_listed_twice() -> None:
    entries = [entry for group in kernel_groups() for entry in group]
    assert len(set(entries)) == len(entries)
