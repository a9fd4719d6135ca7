"""Files next to a plan: pictures of its steps, its CAD model, and the cache of parts made from it.

Files named by a plan are next to it or in a subfolder. Cached parts are named by the hash of their
model; damaged entries and those of another version are remade. If the folder of the plan is not
writable, the user's cache is used.
"""

from __future__ import annotations

import contextlib
import logging
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core import part_model
from ocmm_core.documents import may_be_there, read_bytes, write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.inspection.plan._edit import replace_item
from ocmm_core.inspection.plan._plan import PICTURES, CadModel, Plan, file_fault
from ocmm_core.side_files import has_content

MOST_NAMES = 1000


@dataclass(frozen=True, slots=True)
class FileKind:
    code: str
    """Part of its error codes, and fallback file name."""
    words: str
    endings: Callable[[], Sequence[str]]

    def kept(self, source: Path, content: bytes, folder: Path) -> str:
        """Return the name of a file in the folder of a plan; it is copied if outside.

        A copy gets a portable, unused name. StorageError if it cannot be copied.
        """
        return self.inside(source, folder) or self._copied(source, content, folder)

    def write(self, target: Path, content: bytes) -> None:
        """Write a file; StorageError if that fails."""
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(target, content)
        except OSError as error:
            raise self.not_written(target, error) from error

    def not_written(self, target: Path, error: OSError) -> StorageError:
        return StorageError(
            f"plan.{self.code}_not_written",
            f"{target}: the {self.words} cannot be written ({error.strerror or error}).",
            "Choose a writable folder with enough space.",
        )

    def no_name(self, folder: Path, stem: str) -> StorageError:
        return StorageError(
            f"plan.{self.code}_names",
            f"{folder}: no free file name for {stem}.",
            "Rename the file.",
        )

    def inside(self, source: Path, folder: Path) -> str:
        """Return the name of a file relative to the folder of the plan; empty if outside."""
        source = source.absolute()
        if not source.is_relative_to(folder):
            return ""
        name = source.relative_to(folder).as_posix()
        return "" if file_fault(name, self.words, self.endings()) else name

    def stem(self, source: Path) -> str:
        """Return a portable name without its ending."""
        return re.sub(r"[^A-Za-z0-9_\-]+", "_", source.stem).strip("_-")[:60] or self.code

    def _copied(self, source: Path, content: bytes, folder: Path) -> str:
        stem = self.stem(source)
        for number in range(1, MOST_NAMES):
            name = f"{stem}{'' if number == 1 else f'-{number}'}{source.suffix.lower()}"
            target = folder / name
            if not target.exists():
                self.write(target, content)
                return name
            if has_content(target, content):
                return name
        raise self.no_name(folder, stem)


LARGEST_BYTES = 20_000_000
_SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".jpg": b"\xff\xd8\xff", ".jpeg": b"\xff\xd8\xff"}
_PICTURE = FileKind("picture", "picture", lambda: PICTURES)


def with_picture(plan: Plan, plan_file: Path | None, feature: str, source: Path) -> Plan:
    """Return the plan with a picture for a feature; the file is copied next to the plan.

    A file in that folder is referenced as it is; a copy whose name is in use is numbered.
    InputError if the plan was never saved or lacks the feature, or the file is not a picture;
    StorageError if it cannot be copied.
    """
    if plan_file is None:
        raise InputError(
            "plan.no_file",
            "A picture is stored beside its plan, and the plan has no file yet.",
            "Save the plan first.",
        )
    index = next((i for i, item in enumerate(plan.features) if item.name == feature), None)
    if index is None:
        raise InputError(
            "plan.no_step", "Only probed features can have a picture.", "Select the feature first."
        )
    content = _content(source)
    name = _PICTURE.kept(source, content, plan_file.absolute().parent)
    return replace_item(plan, feature, msgspec.structs.replace(plan.features[index], picture=name))


def without_file(plan: Plan, folder: Path | None) -> list[str]:
    """Return the features whose picture is missing; without a folder, all that have one."""
    return [
        item.name
        for item in plan.features
        if item.picture and (folder is None or not may_be_there(folder / item.picture))
    ]


def carry_pictures(plan: Plan, old: Path, new: Path) -> None:
    """Copy the pictures of a plan, keeping existing files; StorageError on failure."""
    for name in dict.fromkeys(item.picture for item in plan.features if item.picture):
        source, target = old / name, new / name
        if may_be_there(source) and not target.exists():
            _PICTURE.write(target, read_bytes(source))


def _content(source: Path) -> bytes:
    content = read_bytes(source)
    signature = _SIGNATURES.get(source.suffix.lower())
    if signature is None or not content.startswith(signature):
        raise InputError(
            "plan.no_picture",
            f"{source}: not a PNG or JPEG picture.",
            "Choose a picture file ending in .png, .jpg or .jpeg.",
        )
    if len(content) > LARGEST_BYTES:
        raise InputError(
            "plan.large_picture",
            f"{source}: the picture has {len(content) / 1e6:.0f} MB.",
            f"Reduce it to at most {LARGEST_BYTES / 1e6:.0f} MB.",
        )
    return content


FOLDER = ".ocmm-parts"
MOST_FILES = 20
MOST_BYTES = 200_000_000
_log = logging.getLogger(__name__)


def cached_part(folder: Path, sha256: str) -> part_model.PartModel | None:
    """Return the cached part of a model with a hash for a folder of plans, or None."""
    for place in _places(folder):
        path = place / f"{sha256}{part_model.MODEL_ENDING}"
        if not may_be_there(path):
            continue
        try:
            part = part_model.read_model_file(path)
        except OcmmError as error:
            _log.warning("%s is made anew: %s", path, error.what)
            continue
        if part.source_sha256 == sha256:
            return part
    return None


def keep_part(folder: Path, part: part_model.PartModel) -> None:
    """Cache a part, and drop the oldest ones beyond the limit; never raises."""
    for place in _places(folder):
        try:
            place.mkdir(parents=True, exist_ok=True)
            part_model.write_model_file(
                place / f"{part.source_sha256}{part_model.MODEL_ENDING}", part
            )
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
    for path in place.glob(f"*{part_model.MODEL_ENDING}"):
        with contextlib.suppress(OSError):
            stat = path.stat()
            found.append((stat.st_mtime_ns, stat.st_size, path))
    size = 0
    for number, (_, length, path) in enumerate(sorted(found, reverse=True), start=1):
        size += length
        if number > 1 and (number > MOST_FILES or size > MOST_BYTES):
            with contextlib.suppress(OSError):
                path.unlink()


_MODEL = FileKind("model", "CAD model", part_model.model_endings)


@dataclass(frozen=True, slots=True)
class PartOfPlan:
    model: part_model.PartModel | None = None
    """None if no part is shown."""
    doubt: OcmmError | None = None
    """Why the model of the plan is not shown; None if it is shown, or the plan has no model."""


def with_model(
    plan: Plan, plan_file: Path | None, source: Path, part: part_model.PartModel | None = None
) -> Plan:
    """Return the plan with a CAD model; the file is copied next to the plan.

    A file in that folder is referenced as it is; a copy whose name is in use is numbered. The plan
    file may not exist yet. ``source``: a STEP file in whose frame the nominals are; ``part``:
    already read from it, for the cache. InputError if the plan was never saved, the source is not a
    STEP file, or ``part`` is of another file; StorageError if it cannot be copied.
    """
    if plan_file is None:
        raise InputError(
            "plan.no_file",
            "The CAD model is stored beside its plan, and the plan has no file yet.",
            "Save the plan first.",
        )
    if source.suffix.lower() not in part_model.model_endings():
        raise InputError(
            "plan.no_model",
            f"{source}: not a STEP file.",
            f"Choose a CAD model ending in {', '.join(part_model.model_endings())}.",
        )
    files = part_model.model_reader(source).files(source)
    if part is not None and part.source_sha256 != files.sha256:
        raise InputError(
            "plan.other_model", f"{source}: the file was changed meanwhile.", "Import it again."
        )
    folder = plan_file.absolute().parent
    if files.parts:
        name = _MODEL.inside(source, folder) or _kept_together(files, folder)
    else:
        name = _MODEL.kept(source, read_bytes(source), folder)
    if part is not None:
        keep_part(folder, part)
    return msgspec.structs.replace(plan, model=CadModel(file=name, sha256=files.sha256))


def _kept_together(files: part_model.FilesOfModel, folder: Path) -> str:
    """Copy an assembly to a separate folder, and return its name.

    Its files refer to each other by name, so only the folder is renamed, with a number if in use.
    """
    stem = _MODEL.stem(files.top)
    for number in range(1, MOST_NAMES):
        inner = folder / (stem if number == 1 else f"{stem}-{number}")
        if not inner.exists():
            return _copied(files, inner, stem).relative_to(folder).as_posix()
        for target in inner.glob(f"*{stem}{files.top.suffix.lower()}"):
            with suppress(InputError):
                if part_model.model_reader(target).files(target).sha256 == files.sha256:
                    return target.relative_to(folder).as_posix()
    raise _MODEL.no_name(folder, stem)


def _copied(files: part_model.FilesOfModel, folder: Path, stem: str) -> Path:
    try:
        return files.copied(folder, stem)
    except OSError as error:
        raise _MODEL.not_written(folder, error) from error


def carry_model(plan: Plan, old: Path, new: Path) -> None:
    """Copy the CAD model of a plan to another folder; existing files are kept.

    StorageError if it cannot be copied, InputError if its files cannot be read.
    """
    if plan.model is None:
        return
    source, target = old / plan.model.file, new / plan.model.file
    if may_be_there(source) and not target.exists():
        files = part_model.model_reader(source).files(source)
        if files.parts:
            _copied(files, target.parent, target.stem)
        else:
            _MODEL.write(target, read_bytes(source))


def part_of_plan(
    plan: Plan,
    folder: Path | None,
    given_up: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda _: None,
) -> PartOfPlan:
    """Return the part named by a plan, cached or read from its model; never raises.

    ``folder`` of the plan, None if unknown; ``given_up``, ``progress`` as of `ModelReader.read`.
    """
    if plan.model is None or folder is None:
        return PartOfPlan()
    path = folder / plan.model.file
    try:
        if not may_be_there(path):
            raise _not_shown(
                "plan.model_missing",
                f"{path}: the CAD model of the plan is not there",
                "Copy it beside the plan, or import it again.",
            )
        reader = part_model.model_reader(path)
        if reader.files(path).sha256 != plan.model.sha256:
            raise _not_shown(
                "plan.model_changed",
                f"{path}: it is not the CAD model that the plan was made from (another hash)",
                "Restore the file, or import it again.",
            )
        part = cached_part(folder, plan.model.sha256)
        if part is None:
            part = reader.read(path, given_up, progress)
            keep_part(folder, part)
    except OcmmError as error:
        return PartOfPlan(None, error)
    return PartOfPlan(part)


def _not_shown(code: str, what: str, remedy: str) -> InputError:
    return InputError(code, f"{what}; the part is not shown.", remedy)
