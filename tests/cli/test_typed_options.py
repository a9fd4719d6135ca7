"""Each number that a command reads is in the table of typed numbers and within its range."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from typer._click import Context
from typer._click.exceptions import UsageError

from ocmm_cli._app import _BUILT
from ocmm_core.typed_numbers import NUMBER_FIELDS, option_field
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
    if any(word in option.bare_type() for word in ("int", "float"))
]


def word_of(option: Any) -> str:
    return str(next((one for one in option.opts if one.startswith("--")), option.name))


@pytest.mark.parametrize(
    ("name", "option"), OPTIONS, ids=[f"{name} {word_of(one)}" for name, one in OPTIONS]
)
def test_hostile_texts_are_refused_or_within_the_range(name: str, option: Any) -> None:
    field = option_field(name, word_of(option))
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


def test_each_option_of_the_table_exists() -> None:
    known = {
        word
        for name, one in OPTIONS
        for word in (word_of(one), f"{name} {word_of(one)}".replace(" ", "/"))
    }
    listed = [word for field in NUMBER_FIELDS for word in field.options]
    assert set(listed) <= known | {"--quit-after"}
    assert len(listed) == len(set(listed))
