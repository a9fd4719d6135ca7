"""Reader of STEP files for plans: an entry point of the group `ocmm.models`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ocmm_cad.step._model import read_part
from ocmm_cad.step._model_files import model_files
from ocmm_core.part_model import STEP_ENDINGS, ModelReader, PartModel


def _read(path: Path, given_up: Callable[[], bool], progress: Callable[[str], None]) -> PartModel:
    return read_part(path, given_up=given_up, progress=progress)


STEP = ModelReader(STEP_ENDINGS, model_files, _read)
