"""Each number that a command reads is in the table of typed numbers and within its range."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from typer._click import Context
from typer._click.exceptions import UsageError

from ocmm_cli._app import _BUILT
from ocmm_cli.options import option_of
from tests.core.test_typed_numbers import HOSTILE

TEXTS = (*HOSTILE, "-1", "1e300", "1,5", "1e-400", "text", "1 in", "2147483649")


def commands(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield name, command
    for below, one in getattr(command, "commands", {}).items():
        yield from commands(f"{name} {below}", one)


OPTIONS = [
    (name, option)
    for top in _BUILT
    for name, command in commands(top, _BUILT[top])
    for option in command.params
    if {kind := option.type_descriptor.annotation, *get_args(kind)} & {int, float}
]


def word_of(option: Any) -> str:
    return str(next((one for one in option.opts if one.startswith("--")), option.name))


@pytest.mark.parametrize(
    ("name", "option"), OPTIONS, ids=[f"{name} {word_of(one)}" for name, one in OPTIONS]
)
def test_hostile_texts_are_refused_or_within_the_range(name: str, option: Any) -> None:
    entry = option_of(name, option.name)
    assert entry is not None
    field = entry.field
    assert field is not None
    context = Context(_BUILT[name.split()[0]])
    told: set[str] = set()
    for text in TEXTS:
        typed = [text] * option.nargs if option.nargs > 1 or option.multiple else text
        try:
            found = option.process_value(context, typed)
        except UsageError as error:
            told.add(str(error)[-200:])
            continue
        for value in found if isinstance(found, (tuple, list)) else [found]:
            assert math.isfinite(value)
            assert value in field.quantity, text
    assert told
    for sentence in told:
        assert f"{field.quantity.least:g} to {field.quantity.most:g}" in sentence
    assert len(OPTIONS) > 120
