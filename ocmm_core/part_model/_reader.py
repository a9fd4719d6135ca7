"""Readers of CAD models, which packages add by entry points of `ocmm.models`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ocmm_core.errors import InputError
from ocmm_core.part_model._part_model import PartModel
from ocmm_core.plugins import load_all

GROUP = "ocmm.models"
STEP_ENDINGS = (".step", ".stp", ".p21")
"""Of models that a plan may name, whether or not their reader is installed."""


class FilesOfModel(Protocol):
    """A model, and the files of its folder that it names."""

    @property
    def top(self) -> Path: ...
    @property
    def sha256(self) -> str:
        """Return the hash of all bytes."""

    @property
    def parts(self) -> Mapping[str, bytes]:
        """Return the content of each other file by its name, relative to the folder of `top`."""

    def copied(self, folder: Path, stem: str = "model") -> Path:
        """Copy all files to a folder and return the renamed copy of `top`; raises OSError."""


@dataclass(frozen=True, slots=True)
class ModelReader:
    """Reader of one format; errors as InputError that names the file."""

    endings: tuple[str, ...]
    """Endings of its files, in lower case with the dot."""
    files: Callable[[Path], FilesOfModel]
    read: Callable[[Path, Callable[[], bool], Callable[[str], None]], PartModel]
    """Of a path, whether to give up, and progress; mm, frame of the file."""


def model_endings() -> tuple[str, ...]:
    """Return the endings of CAD models that a plan may name."""
    added = (ending for one in _readers() for ending in one.endings)
    return tuple(dict.fromkeys((*STEP_ENDINGS, *added)))


def model_reader(path: Path) -> ModelReader:
    """Return the reader of a model; InputError if none is installed for its ending."""
    ending = path.suffix.lower()
    for one in _readers():
        if ending in one.endings:
            return one
    raise InputError(
        "plan.no_reader",
        f"{path}: this program has no reader of CAD models ending in '{ending}'.",
        "Install the package of the reader; of STEP files, ocmm_cad.",
    )


def _readers() -> Iterator[ModelReader]:
    return load_all(GROUP, ModelReader)
