"""Pictures of the steps of a plan, stored next to it."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ocmm_core.documents import may_be_there, read_bytes
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan._edit import replace_item
from ocmm_core.inspection.plan._file_beside import FileKind
from ocmm_core.inspection.plan._plan import Plan
from ocmm_core.inspection.plan._step_checks import PICTURES

LARGEST_BYTES = 20_000_000
_SIGNATURES = {".png": b"\x89PNG\r\n\x1a\n", ".jpg": b"\xff\xd8\xff", ".jpeg": b"\xff\xd8\xff"}
_PICTURE = FileKind("picture", "picture", PICTURES)


def with_picture(plan: Plan, plan_file: Path | None, feature: str, source: Path) -> Plan:
    """Return the plan with a picture for a feature; the file is copied next to the plan.

    A file in that folder is referenced as it is; a copy whose name is in use is numbered.
    InputError if the plan has no file (was never saved) or no such feature, or the file is no
    picture; StorageError if it cannot be copied.
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
    folder = plan_file.absolute().parent
    name = _PICTURE.kept(source, content, folder)
    return replace_item(plan, feature, msgspec.structs.replace(plan.features[index], picture=name))


def without_file(plan: Plan, folder: Path | None) -> list[str]:
    """Return the features whose picture is missing; all with one if there is no folder."""
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
