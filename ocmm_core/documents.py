"""Validated TOML documents: rigs, probes, parts and plans.

One loader turns every way a document can be wrong into one sentence that names the file and
the field. Documents are data: nothing in them is ever evaluated.
"""

from __future__ import annotations

import hashlib
import math
import os
import tomllib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from ocmm_core.errors import InputError

T = TypeVar("T", bound="Document")


class Document(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Head of every document: what it is, its version and its unit.

    Attributes
    ----------
    schema
        Kind and version, e.g. ``"ocmm.rig/1"``.
    unit
        Unit of every length in the document; only ``"mm"`` is accepted.
    """

    schema: str
    unit: str

    @classmethod
    def completed(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return ``data`` with what older documents of this kind leave unsaid."""
        return data


def load_document(path: Path | str, kind: type[T], schema: str) -> T:
    """Read, check and return the document at ``path``.

    Parameters
    ----------
    path
        A TOML file.
    kind
        The structure that it must have.
    schema
        The ``schema`` line that it must carry.

    Raises
    ------
    InputError
        The file is missing, unreadable, not TOML, of another schema or unit, has an unknown,
        missing or mistyped field, or holds a number that is not finite.
    """
    path = Path(path)
    raw = read_bytes(path)
    try:
        data = tomllib.loads(raw.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(
            "document.encoding",
            f"{path}: byte {error.start} is not UTF-8 text.",
            "Save the file as UTF-8, or restore it from a good copy.",
        ) from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(
            "document.syntax",
            f"{path}: the file is not valid TOML: {error}.",
            "Correct that line, or restore the file from a good copy.",
        ) from error
    found = data.get("schema")
    if found != schema:
        raise InputError(
            "document.schema",
            f"{path}: field 'schema' is {found!r}, but {schema!r} is needed here.",
            "Give a document of that kind and version.",
        )
    if data.get("unit") != "mm":
        raise InputError(
            "document.unit",
            f"{path}: field 'unit' is {data.get('unit')!r}, but lengths must be in 'mm'.",
            'Convert the lengths to millimetres and set unit = "mm".',
        )
    _refuse_non_finite(path, data, "")
    try:
        return msgspec.convert(kind.completed(data), kind)
    except msgspec.ValidationError as error:
        raise InputError(
            "document.field",
            f"{path}: {error}.",
            "Correct that field; see the documents in the resources folder for all fields.",
        ) from error


def read_bytes(path: Path) -> bytes:
    """Return the content of ``path``; raise InputError if it cannot be read."""
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise InputError(
            "document.missing", f"{path}: file not found.", "Check the name and the folder."
        ) from error
    except OSError as error:
        raise InputError(
            "document.unreadable",
            f"{path}: the file cannot be read ({error.strerror}).",
            "Check that it is a file and that you have read permission.",
        ) from error


def digest(path: Path | str) -> str:
    """Return the SHA-256 of the file at ``path`` as hexadecimal text."""
    return hashlib.sha256(read_bytes(Path(path))).hexdigest()


def write_atomic(path: Path, content: bytes) -> None:
    """Write ``content`` to a temporary name beside ``path``, sync it and rename it.

    Raises
    ------
    OSError
        The folder cannot be written; ``path`` then holds what it held before.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    if hasattr(os, "O_DIRECTORY"):
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def resource(*parts: str) -> Path:
    """Return the path of a file shipped in the ``resources`` folder."""
    return _resources().joinpath(*parts)


@cache
def _resources() -> Path:
    """Return the ``resources`` folder: in the package of a wheel, beside the package of a checkout.

    A wheel holds it as ``ocmm_core/resources`` (setup.py). The name at the top of site-packages
    would be anybody's, so the folder beside is read only where the package holds none.
    """
    package = Path(str(files("ocmm_core"))).resolve()
    shipped = package / "resources"
    return shipped if shipped.is_dir() else package.parent / "resources"


def _refuse_non_finite(path: Path, value: Any, field: str) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            _refuse_non_finite(path, item, f"{field}.{key}" if field else key)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _refuse_non_finite(path, item, f"{field}[{index}]")
    elif isinstance(value, float) and not math.isfinite(value):
        raise InputError(
            "document.not_finite",
            f"{path}: field '{field}' is {value}, which is not a usable number.",
            "Give a finite number.",
        )
