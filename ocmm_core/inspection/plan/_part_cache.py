"""Parts as they were made of CAD models, kept beside the plan so that they are not made again.

Each is named by the hash of its model. Nothing is lost with it: what is damaged, of another
version or of another model is made anew. Where the folder of the plan cannot be written they are
kept for this user.
"""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path

import platformdirs

from ocmm_core.documents import may_be_there
from ocmm_core.errors import OcmmError
from ocmm_core.part_model import MODEL_ENDING, PartModel, read_model_file, write_model_file

FOLDER = ".ocmm-parts"
MOST_FILES = 20
MOST_BYTES = 200_000_000
_log = logging.getLogger(__name__)


def cached_part(folder: Path, sha256: str) -> PartModel | None:
    """Return the part of a model that is kept for a folder of plans, or None.

    Parameters
    ----------
    sha256
        Hash of the model.
    """
    for place in _places(folder):
        path = place / f"{sha256}{MODEL_ENDING}"
        if not may_be_there(path):
            continue
        try:
            part = read_model_file(path)
        except OcmmError as error:
            _log.warning("%s is made anew: %s", path, error.what)
            continue
        if part.source_sha256 == sha256:
            return part
    return None


def keep_part(folder: Path, part: PartModel) -> None:
    """Keep a part for the next time, and drop the oldest where there are too many.

    Nothing is raised: without it the part is made once more.
    """
    for place in _places(folder):
        try:
            place.mkdir(parents=True, exist_ok=True)
            write_model_file(place / f"{part.source_sha256}{MODEL_ENDING}", part)
        except OSError as error:
            _log.info("%s: parts cannot be kept here (%s)", place, error)
            continue
        except OcmmError as error:
            _log.warning("A part is not kept: %s", error.what)
            return
        _drop_oldest(place)
        return


def _places(folder: Path) -> tuple[Path, Path]:
    return folder / FOLDER, platformdirs.user_cache_path("ocmm") / "parts"


def _drop_oldest(place: Path) -> None:
    found = []
    for path in place.glob(f"*{MODEL_ENDING}"):
        with contextlib.suppress(OSError):
            stat = path.stat()
            found.append((stat.st_mtime_ns, stat.st_size, path))
    size = 0
    for number, (_, length, path) in enumerate(sorted(found, reverse=True), start=1):
        size += length
        if number > 1 and (number > MOST_FILES or size > MOST_BYTES):
            with contextlib.suppress(OSError):
                path.unlink()
