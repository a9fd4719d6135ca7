"""Values of settings, as stored and as typed."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from ocmm_core.documents import schema_of, shortened
from ocmm_core.errors import InputError
from ocmm_core.settings._specs import Kind, SettingSpec, Value
from ocmm_core.side_files import open_guarded
from ocmm_core.tables import typed_number

_LONGEST = 1000
_MOST_LINES = 50
_MOST_KEYS = 200
_MOST_SHORTCUTS = 4
_SEPARATOR = ";"
_YES, _NO = ("yes", "true", "on", "1"), ("no", "false", "off", "0")
_SOURCE = re.compile(r"simulated|[a-z]+:\S.*")
"""The opening of the job refuses sources that are not installed."""
_PASSWORD = re.compile(r"://[^/@]*:[^/@]*@|[?&](password|passfile)=", re.IGNORECASE)
"""Password in an address: others can read the settings."""
_PICTURE_STARTS = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")


def checked(spec: SettingSpec, value: object) -> Value:
    """Return the checked value of a document; InputError if it does not fit the setting.

    Files and folders are not checked: an absent disk must not lose a setting.
    """
    if spec.kind is Kind.SWITCH:
        if isinstance(value, bool):
            return value
        raise _wrong(spec, value, "must be true or false")
    if spec.kind in (Kind.NUMBER, Kind.WHOLE):
        return _number(spec, value)
    if spec.kind is Kind.LINES:
        if isinstance(value, list | tuple) and all(isinstance(line, str) for line in value):
            if len(value) > _MOST_LINES:
                raise _wrong(spec, value, f"has more than {_MOST_LINES} lines")
            lines = tuple(_text(spec, line) for line in value)
            strange = [line for line in lines if spec.choices and line not in spec.choices]
            if strange or (spec.choices and not lines):
                raise _wrong(spec, value, f"must be some of {', '.join(spec.choices)}")
            return tuple(dict.fromkeys(lines)) if spec.choices else lines
        raise _wrong(spec, value, "must be a list of texts")
    if spec.kind is Kind.KEYS:
        return _keys(spec, value)
    if isinstance(value, Path):
        value = str(value)
    if not isinstance(value, str):
        raise _wrong(spec, value, "must be a text")
    text = _text(spec, value)
    if spec.kind in (Kind.FILE, Kind.FOLDER):
        path = Path(text)
        if not text or not path.expanduser().is_absolute():
            raise _wrong(spec, value, "must be a whole path, from the root or from ~")
        return path.expanduser()
    if spec.kind is Kind.CHOICE and text not in spec.choices:
        raise _wrong(spec, value, f"must be one of {', '.join(spec.choices)}")
    if spec.key == "instrument.source" and not _SOURCE.fullmatch(text):
        raise _wrong(spec, value, f"must be {spec.tip}")
    if spec.key == "archive.address" and _PASSWORD.search(text):
        # The message must not contain the password either.
        raise _wrong(spec, text.rpartition("@")[2].partition("?")[0], "must hold no password")
    return text


def value_of_text(spec: SettingSpec, text: str) -> Value:
    """Return the value of a typed text; an empty text is the default.

    InputError if it is faulty, a file is missing, or a document has another schema.
    """
    text = text.strip()
    if not text:
        return spec.default
    if spec.kind is Kind.SWITCH:
        if text.lower() in _YES + _NO:
            return text.lower() in _YES
        raise _wrong(spec, text, "must be yes or no")
    if spec.kind in (Kind.NUMBER, Kind.WHOLE):
        number = typed_number(text, comma=False)
        if number is None:
            raise _wrong(spec, text, "is not a number")
        return checked(spec, number)
    if spec.kind is Kind.LINES:
        return checked(spec, [line.strip() for line in text.split(_SEPARATOR) if line.strip()])
    if spec.kind is Kind.KEYS:
        raise _wrong(spec, text, "is changed in the list of keys of the window")
    if spec.kind in (Kind.FILE, Kind.FOLDER):
        value = checked(spec, str(Path(text).expanduser().absolute()))
        if isinstance(value, Path):
            look_at(spec, value)
        return value
    return checked(spec, text)


def look_at(spec: SettingSpec, path: Path) -> None:
    """Raise InputError if a file or folder is invalid; output folders may be missing."""
    if spec.kind is Kind.FOLDER:
        if path.exists() and not path.is_dir():
            raise _wrong(spec, str(path), "is a file, not a folder")
        return
    if not path.is_file():
        raise _wrong(spec, str(path), "is not there" if not path.exists() else "is no file")
    if spec.key == "report.logo":
        with open(open_guarded(path), "rb") as stream:  # noqa: PTH123 - the guard opens it
            if not stream.read(8).startswith(_PICTURE_STARTS):
                raise _wrong(spec, str(path), "is neither a PNG nor a JPEG")
    if spec.schemas and _schema_of(path) not in spec.schemas:
        raise _wrong(spec, str(path), f"is no document {', '.join(spec.schemas)}")


def text_of(value: Value) -> str:
    """Return a value as it is typed; inverse of `value_of_text`."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, tuple):
        return f"{_SEPARATOR} ".join(value)
    if isinstance(value, dict):
        return f"{_SEPARATOR} ".join(f"{name}: {' '.join(keys)}" for name, keys in value.items())
    return str(value)


def plain(value: Value) -> Any:
    """Return a value as stored in a document."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple):
        return list(value)
    if isinstance(value, dict):
        return {name: list(keys) for name, keys in value.items()}
    return value


def _number(spec: SettingSpec, value: object) -> float | int:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _wrong(spec, value, "is not a number")
    limits = spec.quantity
    if value not in limits:
        unit = f" {limits.unit}" if limits.unit else ""
        raise _wrong(spec, value, f"must be {limits.least:g} to {limits.most:g}{unit}")
    if spec.kind is Kind.NUMBER:
        return float(value)
    if value != int(value):
        raise _wrong(spec, value, "must be a whole number")
    return int(value)


def _text(spec: SettingSpec, text: str) -> str:
    if len(text) > _LONGEST:
        raise _wrong(spec, text, f"has more than {_LONGEST} characters")
    if not text.isprintable():
        raise _wrong(spec, text, "has characters that cannot be shown")
    return text


def _keys(spec: SettingSpec, value: object) -> dict[str, tuple[str, ...]]:
    if not isinstance(value, dict) or len(value) > _MOST_KEYS:
        raise _wrong(spec, value, "must be a table of actions with their keys")
    found = {}
    for name, keys in value.items():
        if not isinstance(keys, list | tuple) or len(keys) > _MOST_SHORTCUTS:
            raise _wrong(spec, keys, f"must have at most {_MOST_SHORTCUTS} keys for an action")
        if not all(isinstance(key, str) and 0 < len(key) <= 40 for key in keys):
            raise _wrong(spec, keys, "must name keys")
        found[_text(spec, str(name))] = tuple(_text(spec, key) for key in keys)
    return found


def _schema_of(path: Path) -> str:
    try:
        found = schema_of(path)
    except InputError:
        return ""
    return found if isinstance(found, str) else ""


def _wrong(spec: SettingSpec, value: object, why: str) -> InputError:
    return InputError("settings.value", f"{spec.label}: {shortened(value)} {why}.", f"{spec.tip}.")
