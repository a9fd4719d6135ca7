"""Commands from the table: names, texts, defaults and ranges of their options.

A command states the types that it takes; a dataclass stands for the options of its fields.
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Annotated, Any, Literal, get_type_hints

import typer
from rich.console import Group
from typer.core import TyperCommand
from typer.main import get_command_name

from ocmm_cli.options import _instrument, _jobs, _servers
from ocmm_cli.terminal import tr
from ocmm_core.cluster import Site
from ocmm_core.composition import source_help
from ocmm_core.errors import InputError
from ocmm_core.options import DEFAULT_OPERATOR, OF_SETTINGS, SHARED, SPEED, Option, argument
from ocmm_core.typed_numbers import NumberField

_SOURCE, *_OF_SETTINGS = (one for one in OF_SETTINGS if not one.setting.startswith("window."))

_ALL = (
    replace(_SOURCE, text=f"Source of frames. {source_help()}"), *_OF_SETTINGS, *SHARED, SPEED,
    Option("room", "", "Temperature of the room, °C: a number or a range."),
    Option("humidity", "", "Of the air, %."),
    Option("pressure", "", "Of the air, hPa."),
    Option("who", DEFAULT_OPERATOR, "Name for the record."),
    Option("incomplete", False, "Report an incomplete job too; its pages and files say "
           "INCOMPLETE."),
    Option("customer", "", "For whom."),
    Option("json_file", None, "Write the recall to this file, sealed.", flags="--json"),
    Option("pdf_file", None, "Write the recall report to this file.", flags="--pdf"),
    Option("json", False, "Print one JSON object instead of the table."),
    Option("unit", "", "Unit of the lengths in the file, in place of the stated one: inch."),
    Option("columns", "", "Meaning of each column, '-' for one that is not read: name,x,y,z,-."),
    Option("decimal", "", "Decimal sign of the file: point or comma."),
    Option("skip", "", "Lines that are not read: 3 for the first three, or 4-9,12-12."),
    argument("camera", ..., "Name of the camera in the rig."),
    Option("temperature", None, "Ambient temperature, degrees Celsius; default: read the "
           "thermometer of --temperature-u.", "temperature"),
    Option("reason", ..., "Why."),
    Option("site_scheduler", "", "Compute on the workers of this Dask scheduler, e.g. "
           "tls://server:8786; default: this computer.", flags="--scheduler", metavar="ADDRESS"),
    Option("site_workers", None, "Processes of this computer. Default: as it pays.", "workers",
           flags="--workers"),
    Option("site_ca", None, "PEM file: who signed the certificates of the scheduler.",
           flags="--scheduler-ca"),
    Option("site_cert", None, "PEM file: certificate of this computer.", flags="--scheduler-cert"),
    Option("site_key", None, "PEM file: its key.", flags="--scheduler-key"),
    Option("site_unencrypted", False, "Allow a scheduler without TLS in a network: only where "
           "nobody else is in it.", flags="--unencrypted"),
)  # fmt: skip

TABLE = {
    "": _ALL,
    "ocmm": (
        Option("version", False, "Print the version."),
        Option("language", None,
               "Language of all texts; default: that of the window, or of the system."),
    ),
}  # fmt: skip
"""Of all commands, and of the program before the command."""


OPTIONS = {
    (command.strip(), option.name): option
    for table in (TABLE, _jobs.TABLE, _servers.TABLE, _instrument.TABLE)
    for commands, options in table.items()
    for command in commands.split(",")
    for option in options
}
"""The table by command or group, and by name of the parameter."""


@dataclass(frozen=True, slots=True)
class ComputingSite(Site):
    """Site that a command computes at, from its options; checked."""

    dask: bool = True

    def __post_init__(self) -> None:
        self.check()


def option_of(command: str, name: str) -> Option | None:
    """Return the entry of a command, else of its group, else of all; None if not listed.

    An empty text or number is that of the entry for more commands.
    """
    words = command.split()
    places = (" ".join(words[:count]) for count in range(len(words), -1, -1))
    found = [OPTIONS[place, name] for place in places if (place, name) in OPTIONS]
    if not found:
        return None
    own, wider = found[0], found[-1]
    if own.text or own is wider:
        return own
    return replace(wider, default=own.default, number=own.number or wider.number)


class _Command(TyperCommand):
    """A command whose help breaks paths wider than their column; typer cuts them off."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print it."""
        from typer import rich_utils

        # Typer has no option for it.
        rich_utils.Columns = _one_below_another  # type: ignore[assignment, attr-defined]
        super().format_help(ctx, formatter)


def _one_below_another(texts: Iterable[Any]) -> Group:
    texts = list(texts)
    for text in texts:
        text.overflow = "fold"
    return Group(*texts)


def describe(app: typer.Typer, path: str = "") -> None:
    """Give all commands of an application their options; KeyError for one not in the table."""
    for group in app.registered_groups:
        inner = group.typer_instance
        if inner is not None:
            name = group.name if isinstance(group.name, str) else inner.info.name
            describe(inner, f"{path} {name}".strip())
    for one in app.registered_commands:
        if one.callback is not None:
            name = one.name or get_command_name(one.callback.__name__)
            one.callback = described(one.callback, f"{path} {name}".strip())
            one.cls = _Command


def described(command: Callable[..., Any], path: str) -> Callable[..., Any]:
    """Return a command with the options of the table."""
    own = inspect.signature(command, eval_str=True)
    parameters: list[inspect.Parameter] = []
    structs: dict[str, tuple[Any, dict[str, str]]] = {}
    for one in own.parameters.values():
        if is_dataclass(one.annotation):
            names = _names_of_fields(one, path)
            types = get_type_hints(one.annotation)
            parameters += [
                _parameter(one.replace(name=name, annotation=types[field]), path)
                for field, name in names.items()
            ]
            structs[one.name] = one.annotation, names
        else:
            parameters.append(_parameter(one, path))

    @functools.wraps(command)
    def run(**given: Any) -> Any:
        for name, (struct, names) in structs.items():
            given[name] = struct(**{field: given.pop(one) for field, one in names.items()})
        return command(**given)

    run.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    # The terminal breaks the lines; those of the source are of another width.
    run.__doc__ = re.sub(r"(?<=\S)\n(?=[^\s-]|--)", " ", inspect.cleandoc(command.__doc__ or ""))
    return run


def _names_of_fields(one: inspect.Parameter, path: str) -> dict[str, str]:
    """Return the parameters of fields: with the name of the struct before, else their own."""
    names = [field.name for field in fields(one.annotation)]
    own = {name: f"{one.name}_{name}" for name in names if option_of(path, f"{one.name}_{name}")}
    return own or {name: name for name in names if option_of(path, name)}


def _parameter(one: inspect.Parameter, path: str) -> inspect.Parameter:
    """Return a parameter with its option; the command may add how the value is read."""
    one = one.replace(kind=inspect.Parameter.KEYWORD_ONLY)
    if one.annotation is typer.Context:
        return one
    info = next(iter(getattr(one.annotation, "__metadata__", ())), None)
    if info is not None and (info.help or info.param_decls or info.default is not ...):
        # A command of another maker, which describes its own options.
        return one
    option = option_of(path, one.name)
    if option is None:
        raise KeyError(f"{path} {one.name}")
    kind = one.annotation if info is None else one.annotation.__origin__
    info = copy(info or (typer.Argument() if option.is_argument else typer.Option()))
    info.help, info.metavar = option.text or None, info.metavar or option.metavar
    info.param_decls = () if option.is_argument else option.typed
    if option.choices:
        chosen: Any = Literal.__getitem__(option.choices)
        kind = chosen if kind is str else chosen | None
    default = one.empty if option.default is ... else option.default
    return one.replace(default=default, annotation=Annotated[kind, info])


def read_typed_numbers(command: Any, path: str) -> None:
    """Make a command and its subcommands read numbers as the fields of the window do."""
    for below, one in getattr(command, "commands", {}).items():
        read_typed_numbers(one, f"{path} {below}")
    for parameter in command.params:
        option = option_of(path, parameter.name)
        # The texts differ for a command of another maker, which has its own options.
        if option is None or option.field is None or (parameter.help or "") != option.text:
            continue
        field = option.field
        number = int if field.whole else float
        parameter.min, parameter.max = number(field.quantity.least), number(field.quantity.most)
        parameter.process_value = partial(_read, parameter, field, parameter.process_value)


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
            what = f"{tr(error.what)} {tr(error.remedy)}"
            raise typer.BadParameter(what, ctx=context, param=option) from error

    if isinstance(value, (list, tuple)):
        value = type(value)(map(number, value))
    return process(context, number(value))
