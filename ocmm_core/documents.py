"""Validated TOML documents: rigs, probes, parts and plans; nothing in them is evaluated."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import reprlib
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from ocmm_core.cleanup import temporary_file
from ocmm_core.errors import InputError
from ocmm_core.host import HOST
from ocmm_core.side_files import OversizeError, read_guarded

if TYPE_CHECKING:
    from lxml import etree

LONGEST_NAME = 255
"""Characters of the name of a file with its folders."""
T = TypeVar("T", bound="Document")
D = TypeVar("D")

LARGEST_FILE = 64 << 20
"""Bytes of the largest file that is read whole; longer ones are refused."""
LARGEST_DOCUMENT = 1 << 20
"""Bytes of the largest TOML document: a plan of some three thousand features."""
_LARGEST_NUMBER = 1e15
"""In mm some seven astronomical units; its powers stay far from overflow."""
_DEEPEST_KEY = 16
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){17}""")
_TOO_LONG = "a number has too many digits"
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = _SHORT.maxother = 80


class Document(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Head of every document: kind, version and unit."""

    schema: str
    """Kind and version, e.g. ``"ocmm.rig/1"``."""
    unit: str
    """Unit of every length in the document; only ``"mm"`` is accepted."""

    @classmethod
    def completed(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return ``data`` with the fields that older documents of this kind lack."""
        return data


def load_document(path: Path | str, kind: type[T], schema: str) -> T:
    """Read, check and return the document at ``path`` with this ``schema`` line.

    InputError if the file is missing, unreadable, not TOML, of another schema or unit, has an
    unknown, missing or mistyped field, or holds a number that is not finite.
    """
    return load_with_text(path, kind, schema)[0]


def load_with_text(path: Path | str, kind: type[T], schema: str) -> tuple[T, str]:
    """Return what `load_document` returns, and the text it was read from, for its identity."""
    path = Path(path)
    text = read_text(path, LARGEST_DOCUMENT)
    data = _parsed(path, text)
    found = data.get("schema")
    if found != schema:
        raise InputError(
            "document.schema",
            f"{path}: field 'schema' is {shortened(found)}, but {schema!r} is needed here.",
            "Give a document of that kind and version.",
        )
    if data.get("unit") != "mm":
        raise InputError(
            "document.unit",
            f"{path}: field 'unit' is {shortened(data.get('unit'))}, but lengths must be in 'mm'.",
            'Convert the lengths to millimetres and set unit = "mm".',
        )
    _refuse_unusable(path, data, "")
    try:
        return msgspec.convert(kind.completed(data), kind), text
    except (msgspec.ValidationError, UnicodeError) as error:
        raise InputError(
            "document.field",
            f"{path}: {error}.",
            "Correct that field; see the documents in the resources folder for all fields.",
        ) from error


def schema_of(path: Path | str) -> object:
    """Return the schema line of the document at ``path``, None without one; or InputError."""
    return _parsed(Path(path), read_text(Path(path), LARGEST_DOCUMENT)).get("schema")


def may_be_there(path: Path) -> bool:
    """Return whether a file exists, or may exist in a folder that cannot be read."""
    try:
        return path.is_file()
    except OSError:
        return True


def stays_inside(name: str) -> bool:
    """Return whether a relative name of a file stays in its folder, on Windows also."""
    path, windows = PurePosixPath(name), PureWindowsPath(name)
    outside = path.is_absolute() or ".." in path.parts or "\\" in name or windows.drive
    return bool(name) and not (
        outside or ":" in name or not name.isprintable() or len(name) > LONGEST_NAME
    )


def read_bytes(path: Path, most: int = LARGEST_FILE, *, follow: bool = True) -> bytes:
    """Return the content of ``path``; at most ``most`` bytes are read, and a link if ``follow``.

    InputError if it is missing, no file, larger, or cannot be read.
    """
    try:
        return read_guarded(path, most, follow=follow)
    except FileNotFoundError as error:
        raise InputError(
            "document.missing", f"{path}: file not found.", "Check the name and the folder."
        ) from error
    except OversizeError as error:
        raise InputError(
            "document.too_large",
            f"{path}: the file has {error.size:,} bytes, and at most {most:,} are read.",
            "Check that it is the right file.",
        ) from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            "document.unreadable",
            f"{path}: the file cannot be read ({reason}).",
            "Check that it is a file and that you have read permission.",
        ) from error


def read_text(path: Path, most: int = LARGEST_FILE) -> str:
    """Return the text of ``path``, with its line ends; InputError also if it is not UTF-8."""
    raw = read_bytes(path, most)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(
            "document.encoding",
            f"{path}: byte {error.start}, in line {line}, is not UTF-8 text.",
            "Save the file as UTF-8, or restore it from a good copy.",
        ) from error


def decode_json(content: bytes | str, kind: type[D]) -> D:
    """Return the content of a JSON text.

    msgspec.MsgspecError if it is not JSON, not UTF-8, of another kind, or nested too deeply.
    """
    try:
        return msgspec.json.decode(content, type=kind)
    except RecursionError as error:
        raise msgspec.DecodeError("it is nested too deeply") from error
    except UnicodeError as error:
        raise msgspec.DecodeError("it is not UTF-8 text") from error


_DOCUMENT_TYPE = "it has a document type, which may name other files"


def untrusted_xml(content: bytes, *, comments: bool = False) -> etree._Element:
    """Return the root of a document; ValueError: it is not XML, or has a document type.

    No entity is resolved, and no other file is read. `comments`: keep them and instructions.
    """
    from lxml import etree

    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, dtd_validation=False,
        huge_tree=False, recover=False, remove_comments=not comments, remove_pis=not comments,
    )  # fmt: skip
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise ValueError(str(error)) from error
    if root.getroottree().docinfo.internalDTD is not None:
        raise ValueError(_DOCUMENT_TYPE)
    return root


def shortened(value: object) -> str:
    """Return a value of a file for a sentence, shortened to a few words."""
    return _SHORT.repr(value)


def find_files(root: Path, suffix: str = "") -> tuple[list[Path], list[InputError]]:
    """Return the files below a folder by name, and an error for each skipped folder.

    Unreadable folders and links to folders are skipped. A missing folder has no files.
    """
    found: list[Path] = []
    left_out: list[InputError] = []

    def leave_out(folder: str, why: str, remedy: str) -> None:
        left_out.append(InputError("folder.left_out", f"{folder}: {why}.", remedy))

    def unreadable(error: OSError) -> None:
        if isinstance(error, FileNotFoundError):
            return
        why = f"this folder cannot be read ({error.strerror})"
        leave_out(error.filename, why, "Have it made readable for this user, then repeat.")

    for place, folders, names in os.walk(root, onerror=unreadable):
        folders.sort()
        for path in (os.path.join(place, name) for name in folders):  # noqa: PTH118 - many of them
            if os.path.islink(path):  # noqa: PTH114 - as above
                leave_out(path, "this folder is a link, which is not searched", "Give its target.")
        found += [Path(place, name) for name in sorted(names) if name.lower().endswith(suffix)]
    return sorted(found), left_out


def files_of_folder(folder: Path, suffix: str) -> list[Path]:
    """Return the files in a folder by name; empty if there is none, InputError if unreadable."""
    try:
        names = os.listdir(folder)  # noqa: PTH208 - names, not paths
    except FileNotFoundError:
        return []
    except OSError as error:
        raise InputError(
            "folder.unreadable",
            f"{folder}: this folder cannot be read ({error.strerror}).",
            "Have it made readable for this user, then repeat.",
        ) from error
    return sorted(folder / name for name in names if name.lower().endswith(suffix))


def digest(path: Path | str) -> str:
    """Return the SHA-256 of the file at ``path`` as hexadecimal text."""
    return hashlib.sha256(read_bytes(Path(path))).hexdigest()


def text_digest(text: str) -> str:
    """Return the SHA-256 of a file with this text, as `digest`."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def write_atomic(path: Path, content: bytes) -> None:
    """Write ``content`` to a temporary name next to ``path``, sync it and rename it.

    OSError if the folder cannot be written; ``path`` is unchanged then. If the folder could not be
    synced, it has the new content, which a power failure may still revert.
    """
    with written_beside(path, content) as temporary:
        temporary.replace(path)
    HOST.sync_folder(path.parent)


def write_new(path: Path, content: bytes) -> os.stat_result:
    """Write a new file, complete from the first moment or not at all; return its state.

    Raises FileExistsError if the file exists, and leaves it unchanged; OSError if the folder cannot
    be written, and leaves no file.
    """
    with written_beside(path, content) as temporary:
        state = temporary.lstat()
        try:
            os.link(temporary, path)
        except FileExistsError:
            raise
        except OSError:
            # File systems without hard links, e.g. of memory cards.
            HOST.rename_new(temporary, path)
    try:
        HOST.sync_folder(path.parent)
    except OSError:
        HOST.remove_same(path, state.st_dev, state.st_ino)
        raise
    return state


@contextlib.contextmanager
def written_beside(path: Path, content: bytes) -> Iterator[Path]:
    """Yield a file next to ``path`` with this content, synced; delete it at the end.

    Meanwhile it is locked, so that `cleanup` does not remove it. A caller keeps it by renaming
    it. A failed sync is never retried on the same file: the second one can succeed without having
    written anything. OSError if the folder cannot be written.
    """
    descriptor, temporary = temporary_file(path)
    try:
        try:
            rest = memoryview(content)
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fsync(descriptor)
        finally:
            if HOST.closes_before_rename:
                os.close(descriptor)
        yield temporary
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if not HOST.closes_before_rename:
            os.close(descriptor)


def resource(*parts: str) -> Path:
    """Return the path of a file shipped in the ``resources`` folder."""
    return _resources().joinpath(*parts)


@cache
def sql_statements(folder: str, name: str) -> tuple[str, ...]:
    """Return the statements of a shipped file, without comments and the semicolons at line ends."""
    lines = read_text(resource(folder, f"{name}.sql")).splitlines()
    text = "\n".join(line for line in lines if not line.startswith("--"))
    return tuple(text.removesuffix(";").split(";\n"))


@cache
def _resources() -> Path:
    """Return the ``resources`` folder: inside the package in a wheel, next to it in a checkout.

    Wheels contain it as ``ocmm_core/resources`` (setup.py). A folder of this name at the top of
    site-packages can belong to another package, so it is used only if the package contains none.
    """
    package = Path(str(files("ocmm_core"))).resolve()
    shipped = package / "resources"
    return shipped if shipped.is_dir() else package.parent / "resources"


def _parsed(path: Path, text: str) -> dict[str, Any]:
    reason = ""
    # Parsing time grows with the square of the number of parts of a key.
    if _LONG_KEY.search(text):
        reason = f"a key has more than {_DEEPEST_KEY} parts"
    else:
        try:
            return tomllib.loads(text)
        except RecursionError:
            reason = "it is nested too deeply"
        except ValueError as error:
            # Also raised for integers with thousands of digits, which Python does not convert.
            reason = str(error) if isinstance(error, tomllib.TOMLDecodeError) else _TOO_LONG
    raise InputError(
        "document.syntax",
        f"{path}: the file is not valid TOML: {reason}.",
        "Correct that line, or restore the file from a good copy.",
    )


def _refuse_unusable(path: Path, value: Any, field: str) -> None:
    """Raise InputError if a number is not finite, or implausibly large."""
    if isinstance(value, dict):
        for key, item in value.items():
            _refuse_unusable(path, item, f"{field}.{key}" if field else key)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _refuse_unusable(path, item, f"{field}[{index}]")
    elif isinstance(value, int | float) and not _is_usable(value):
        raise InputError(
            "document.not_finite",
            f"{path}: field {shortened(field)} is {shortened(value)}, which is not a usable "
            "number.",
            f"Give a finite number below {_LARGEST_NUMBER:.0e}.",
        )


def _is_usable(value: float) -> bool:
    # The type of the field refuses integers that no float can hold.
    return abs(value) <= _LARGEST_NUMBER or (isinstance(value, int) and abs(value) > 10**308)
