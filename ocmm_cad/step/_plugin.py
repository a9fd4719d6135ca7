"""Reader of STEP files for plans: an entry point of the group `ocmm.models`.

Plans ask it for its endings alone; what reads is imported when a model is read.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_core.part_model import STEP_ENDINGS, FilesOfModel, ModelReader, PartModel


def _files(path: Path) -> FilesOfModel:
    from ocmm_cad.step._model_files import model_files

    return model_files(path)


def _read(path: Path, given_up: Callable[[], bool], progress: Callable[[str], None]) -> PartModel:
    from ocmm_cad.step._model import read_part

    return read_part(path, given_up=given_up, progress=progress)


STEP = ModelReader(STEP_ENDINGS, _files, _read)
