"""Registry of the commands: one entry each, which the session, the tables and the docs read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ocmm_serve.ippdme._dialect import DmeDialect
from ocmm_serve.ippdme._grammar import Value
from ocmm_serve.ippdme._state import CommandedTouch, DmeState

BOTH = frozenset(DmeDialect)
NEWER = frozenset({DmeDialect.V25})
Handler = Callable[[DmeState, tuple[Value, ...]], "list[str] | CommandedTouch | None"]
"""Returns the data lines of an answer, if any, or the target of a touch that is waited for."""


@dataclass(frozen=True, slots=True)
class CommandSpec:
    """A command in the table of the server."""

    name: str
    group: str
    """Class of the protocol."""
    arguments: str
    about: str
    """What this machine does, a sentence for the documentation."""
    handler: Handler
    dialects: frozenset[DmeDialect] = BOTH
    fast: bool = False
    """Overtakes waiting commands, and may carry an event tag."""
    always: bool = False
    """Executed also in the error state."""
    takes_user: bool = False
    """Executes DisableUser implicitly."""


COMMANDS: dict[str, CommandSpec] = {}
"""All commands by name, in the order of the documentation."""


def command(
    name: str,
    group: str,
    arguments: str,
    about: str,
    *,
    dialects: frozenset[DmeDialect] = BOTH,
    fast: bool = False,
    always: bool = False,
    takes_user: bool = False,
) -> Callable[[Handler], Handler]:
    """Register the handler of a command."""

    def register(handler: Handler) -> Handler:
        COMMANDS[name] = CommandSpec(
            name, group, arguments, about, handler, dialects, fast, always, takes_user
        )
        return handler

    return register


def supported(dialect: DmeDialect) -> Mapping[str, CommandSpec]:
    """Return the commands of a dialect."""
    return {name: one for name, one in COMMANDS.items() if dialect in one.dialects}
