"""Parts that installed packages add to the program, by entry points.

Groups: `ocmm.sources` (`ocmm_core.composition.SourceSpec`), `ocmm.models`
(`ocmm_core.part_model.ModelReader`), `ocmm.clusters` (`ocmm_core.cluster.Cluster`), `ocmm.exports`
(`ocmm_core.export.report.Exporter`), `ocmm.records` (`ocmm_core.export.audits.AuditedRecord`),
`ocmm.services` (`ocmm_core.station.ServiceSpec`) and `ocmm.commands` (of `ocmm`). Packages of this
program come first; a name is given once, and the first one counts.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")

_SET_UP_BY_OPTION = ("boards", "opcua", "screen", "sensors", "shop", "step")
_OURS = "ocmm"
"""Distribution of this program."""
_log = logging.getLogger(__name__)


def install_line(extra: str) -> str:
    """Return the command that installs an extra into this checkout or environment."""
    if (Path(__file__).parents[1] / "run").is_file():
        return "./run setup" + (f" --{extra}" if extra in _SET_UP_BY_OPTION else "")
    # pip reads the extras of the installed package, and queries no index for it.
    return f"pip install 'ocmm[{extra}]'"


def names(group: str) -> tuple[str, ...]:
    """Return the names of a group without loading what they name."""
    return tuple(_entries(group))


def load(group: str, name: str, kind: type[T]) -> T | None:
    """Return an added part; None if it is not installed or cannot be loaded."""
    entry = _entries(group).get(name)
    return None if entry is None else _loaded(entry, kind)


def load_all(group: str, kind: type[T]) -> Iterator[T]:
    """Yield the parts of a group that can be loaded."""
    for entry in _entries(group).values():
        found = _loaded(entry, kind)
        if found is not None:
            yield found


@cache
def _entries(group: str) -> dict[str, EntryPoint]:
    found = sorted(
        entry_points(group=group),
        # The order of a distribution's own entries is that of its file.
        key=lambda one: one.dist is None or one.dist.name != _OURS,
    )
    entries: dict[str, EntryPoint] = {}
    for one in found:
        entries.setdefault(one.name, one)
    return entries


def _loaded(entry: EntryPoint, kind: type[T]) -> T | None:
    found = _object(entry)
    if found is None or isinstance(found, kind):
        return found
    _log.warning("%s of %s is no %s: %s", entry.name, entry.group, kind.__name__, entry.value)
    return None


@cache
def _object(entry: EntryPoint) -> object | None:
    """Return what an entry names; what cannot be loaded is tried and logged once."""
    try:
        found: object = entry.load()
    except ModuleNotFoundError as error:
        # A package of this program that was left out on purpose is no fault.
        if error.name != entry.module.partition(".")[0]:
            _log.warning("%s of %s was not loaded: %s", entry.name, entry.group, error)
        return None
    except Exception as error:
        _log.warning("%s of %s was not loaded: %s", entry.name, entry.group, error)
        return None
    return found
