"""Files of a model: an assembly may name part files in its folder.

All are checked and hashed here, and the geometry library reads a copy: the hash is of what it
reads, and no name leads out of the folder.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ocmm_cad import pmi
from ocmm_core.documents import read_bytes, shortened, stays_inside, write_atomic
from ocmm_core.errors import InputError
from ocmm_core.part_model import STEP_ENDINGS

_HEAD = b"ISO-10303-21"
_FILE, _NAMED = "DOCUMENT_FILE", "EXTERNAL_IDENTIFICATION_ASSIGNMENT"
_OTHER_FILES = re.compile(rb"^\s*REFERENCE\s*;\s*([^;]*);", re.MULTILINE)
_QUOTED = re.compile(rb"'[^']*'")
"""Names and notes: a part called DATUM PLATE has no datum."""
_PAPERS = frozenset(
    (".pdf", ".txt", ".doc", ".docx", ".xls", ".xlsx", ".csv", ".htm", ".html", ".png", ".jpg",
     ".jpeg", ".tif", ".tiff", ".svg", ".dwg", ".dxf")
)  # fmt: skip
"""Suffixes of documents without geometry: drawings, notes and pictures."""
_MOST_PARTS, _MOST_BYTES = 1000, 1_000_000_000


@dataclass(frozen=True, slots=True)
class ModelFiles:
    """A STEP file and the part files that it names."""

    top: Path
    sha256: str
    """Of the bytes of a single file; of several, of the names and hashes of all."""
    parts: dict[str, bytes]
    """Content of each part file by its name, relative to the folder of ``top``."""
    papers: tuple[str, ...] = ()
    """Documents without geometry, which are not read."""

    @property
    def have_tolerances(self) -> bool:
        """Return whether a part file may contain tolerances, which are read from ``top`` only."""
        return any(
            pmi.may_say_tolerances(_QUOTED.sub(b"", one).decode("utf-8", errors="replace"))
            for one in self.parts.values()
        )

    def is_unchanged(self) -> bool:
        parts = {name: read_bytes(self.top.parent / name) for name in self.parts}
        return _hash_of(read_bytes(self.top), parts) == self.sha256

    def copied(self, folder: Path, stem: str = "model") -> Path:
        """Copy all files to a folder and return the renamed copy of ``top``; raises OSError."""
        names = {name.lower() for name in self.parts}
        top = f"{stem}{self.top.suffix.lower()}"
        while top.lower() in names:
            top = f"_{top}"
        for name, content in self.parts.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_atomic(folder / name, content)
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(folder / top, read_bytes(self.top))
        return folder / top


def model_files(path: Path) -> ModelFiles:
    """Return a STEP file with all files that it names, directly or through another one.

    InputError, with the name: it is no STEP file; a part file is missing, outside of its folder, no
    regular file or no STEP file.
    """
    content = read_bytes(path)
    if not content.lstrip().startswith(_HEAD):
        raise step_error(path, "not a STEP file", f"Choose a file ending in {_endings()}.")
    parts: dict[str, bytes] = {}
    names, papers = _checked_names(path, content)
    asked = [("", name) for name in names]
    size = 0
    while asked:
        owner, written = asked.pop()
        name = (PurePosixPath(owner).parent / written).as_posix()
        if name in parts:
            continue
        found = _part(path, name)
        size += len(found)
        if len(parts) >= _MOST_PARTS or size > _MOST_BYTES:
            raise step_error(
                path, f"it has more than {_MOST_PARTS} part files, or 1 GB of them",
                "Export the part that is measured alone.",
            )  # fmt: skip
        parts[name] = found
        names, more = _checked_names(path.parent / name, found)
        asked += [(name, one) for one in names]
        papers += more
    _refuse_rings(path, parts)
    return ModelFiles(path, _hash_of(content, parts), parts, tuple(dict.fromkeys(papers)))


def _hash_of(top: bytes, parts: Mapping[str, bytes]) -> str:
    own = hashlib.sha256(top).hexdigest()
    if not parts:
        return own
    lines = [own, *(f"{name}\0{hashlib.sha256(parts[name]).hexdigest()}" for name in sorted(parts))]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def step_error(path: Path, what: str, remedy: str) -> InputError:
    return InputError("plan.step", f"{path}: {what}.", remedy)


def _part(top: Path, name: str) -> bytes:
    path = top.parent / name
    try:
        real, folder = path.resolve(), top.parent.resolve()
    except (OSError, RuntimeError):
        real, folder = path, path
    if not real.is_relative_to(folder) or real == folder:
        raise _outside(top, name)
    if real == top.resolve():
        raise _ring(top, name)
    if not path.exists():
        raise step_error(
            top, f"its part file {shortened(name)} is not in its folder",
            "Copy all files of the assembly into one folder, or export it as one file.",
        )  # fmt: skip
    try:
        content = read_bytes(path)
    except InputError as error:
        fault = error.what.rstrip(".")
        raise step_error(top, f"its part file cannot be read: {fault}", error.remedy) from error
    if not content.lstrip().startswith(_HEAD):
        raise step_error(
            top, f"its part file {shortened(name)} is not a STEP file",
            "Export the assembly as one STEP file.",
        )  # fmt: skip
    return content


def _checked_names(path: Path, content: bytes) -> tuple[list[str], list[str]]:
    """Return part files and documents without geometry of a file; InputError if invalid."""
    if found := _OTHER_FILES.search(content):
        words = shortened(" ".join(found[1].decode("utf-8", errors="replace").split()))
        raise step_error(
            path, f"it refers to entities of other files ({words}), which are not read",
            "Export the assembly as one file.",
        )  # fmt: skip
    if _FILE.encode() not in content.upper():
        return [], []
    try:
        file = pmi.picked_entities(content, (_FILE, _NAMED, "EXTERNAL_SOURCE"))
        named = _names_by_document(file)
        files = [(number, _own_name(file, number)) for number in file.all_of(_FILE)]
    except pmi.BadEntityError as error:
        raise step_error(
            path, f"the names of its part files cannot be read: {error}",
            "Export the assembly as one file.",
        ) from error  # fmt: skip
    parts, papers = set[str](), list[str]()
    for number, own in files:
        names = [own, *named.get(number, ())]
        part = _part_name(path, number, names)
        if part:
            parts.add(part)
        else:
            papers.append(next(name for name in names if _is_paper(name)))
    return sorted(parts), papers


def _own_name(file: pmi.Part21, number: int) -> str:
    arguments = file.arguments(number, _FILE, "DOCUMENT")
    if not arguments:
        arguments = file.arguments(number, "DOCUMENT")
    return pmi.plain(arguments[0])


def _names_by_document(file: pmi.Part21) -> dict[int, list[str]]:
    found: dict[int, list[str]] = {}
    for number in file.all_of(f"APPLIED_{_NAMED}", f"CC_DESIGN_{_NAMED}", _NAMED):
        records = file.records(number)
        arguments = [value for values in records.values() for value in values]
        names = [pmi.plain(arguments[0])] if arguments else []
        for other in pmi.refs(tuple(arguments)):
            if other in file.bodies and "EXTERNAL_SOURCE" in file.types(other):
                (source, *_) = file.arguments(other, "EXTERNAL_SOURCE")
                values = source.values if isinstance(source, pmi.Typed) else (source,)
                names += [pmi.plain(one) for one in values]
        for other in pmi.refs(tuple(arguments)):
            found.setdefault(other, []).extend(names)
    return found


def _part_name(path: Path, number: int, names: list[str]) -> str:
    """Return the part file of a document; empty if it has no geometry."""
    said = [name for name in dict.fromkeys(names) if name]
    parts = [name for name in said if name.lower().endswith(STEP_ENDINGS)]
    if len(parts) > 1:
        words = ", ".join(map(shortened, parts))
        raise step_error(
            path, f"its document #{number} names several part files ({words})",
            "Export the assembly as one file.",
        )  # fmt: skip
    if parts:
        if not stays_inside(parts[0]):
            raise _outside(path, parts[0])
        return parts[0]
    if any(map(_is_paper, said)):
        return ""
    words = shortened(said[0]) if said else "without a name"
    raise step_error(
        path, f"its part file {words} (#{number}) is not a STEP file",
        f"Export the assembly as one STEP file, or its parts as {_endings()}.",
    )  # fmt: skip


def _is_paper(name: str) -> bool:
    return PurePosixPath(name.replace("\\", "/")).suffix.lower() in _PAPERS


def _refuse_rings(top: Path, parts: dict[str, bytes]) -> None:
    """Refuse part files that contain themselves through others: their reading would never end."""
    under = {
        name: [
            (PurePosixPath(name).parent / one).as_posix()
            for one in _checked_names(top.parent / name, content)[0]
        ]
        for name, content in parts.items()
    }
    ready: set[str] = set()
    while len(ready) < len(under):
        more = {name for name in under.keys() - ready if ready.issuperset(under[name])}
        if not more:
            raise _ring(top, min(under.keys() - ready))
        ready |= more


def _ring(top: Path, name: str) -> InputError:
    return step_error(
        top, f"its part file {shortened(name)} contains itself", "Export the assembly as one file."
    )


def _outside(top: Path, name: str) -> InputError:
    return step_error(
        top, f"its part file {shortened(name)} does not lie in its folder, and is not read",
        "Copy all files of the assembly into one folder, or export it as one file.",
    )  # fmt: skip


def _endings() -> str:
    return ", ".join(STEP_ENDINGS)
