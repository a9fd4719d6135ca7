"""Numeric options of commands, checked by the table of typed numbers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, get_args

import typer

from ocmm_cli.terminal._speech import say
from ocmm_core.errors import InputError
from ocmm_core.typed_numbers import NumberField, option_field


def read_typed_numbers(command: Any, name: str) -> None:
    """Make a command and its subcommands read numbers as the fields of the window do.

    Raises KeyError if a numeric option is not in the table.
    """
    for below, one in getattr(command, "commands", {}).items():
        read_typed_numbers(one, f"{name} {below}")
    for option in command.params:
        kind = option.type_descriptor.annotation
        if not {kind, *get_args(kind)} & {int, float}:
            continue
        word = next((one for one in option.opts if one.startswith("--")), option.name)
        field = option_field(name, word)
        if field is None:
            raise KeyError(f"{name} {word}")
        number = int if field.whole else float
        option.min, option.max = number(field.quantity.least), number(field.quantity.most)
        option.process_value = partial(_read, option, field, option.process_value)


def _read(
    option: Any, field: NumberField, process: Callable[..., Any], context: Any, value: Any
) -> Any:
    """Return the value of an option; typed texts are read by its field."""

    def number(text: Any) -> Any:
        if not isinstance(text, str):
            return text
        try:
            return int(field.read(text)) if field.whole else field.read(text)
        except InputError as error:
            what = f"{say(error.what)} {say(error.remedy)}"
            raise typer.BadParameter(what, ctx=context, param=option) from error

    if isinstance(value, (list, tuple)):
        value = type(value)(map(number, value))
    return process(context, number(value))
