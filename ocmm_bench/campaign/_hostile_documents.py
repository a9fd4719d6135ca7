"""Forged or damaged documents, tables, points, recordings and records."""

from __future__ import annotations

import copy
import json
import math
import os
import struct
import tomllib
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_bench.campaign._hostile_runs import DEEP, LONG_DIGITS, MARKUP, Forgery

WRONG: dict[str, Any] = {
    "nothing": "", "markup": MARKUP, "control codes": "\x1b[2J\x1b]0;t\x07", "a path": "../../x",
    "long": "x" * 200_000, "-1": -1, "0": 0, "10**18": 10**18, "10**40": 10**40, "1e308": 1e308,
    "1e14": 1e14, "1e-308": 1e-308, "nan": math.nan, "inf": math.inf, "true": True, "a list": [],
    "a deep list": [[[[[[[[]]]]]]]], "a table": {}, "a long list": [0.0] * 20_000, "-0.5": -0.5,
}  # fmt: skip
"""Replacements of a leaf of a document."""

TOO_LONG_NUMBER = object()


def document_kinds(what: str, good: str, n: int, seed: int) -> list[Forgery]:
    """Return kinds of a hostile document ``what``, ``n`` of them with one leaf replaced."""
    return [*_as_text(what, good), *leaf_kinds(what, good, n, seed)]


def as_toml(document: dict[str, Any]) -> str:
    """Return a document as TOML, one line a key."""
    return "".join(f"{_key(key)} = {_inline(value)}\n" for key, value in document.items())


def _key(key: str) -> str:
    return key if key.isidentifier() and key.isascii() else json.dumps(key)


def _inline(value: Any) -> str:
    if value is TOO_LONG_NUMBER:
        return LONG_DIGITS
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return repr(value)


def _paths(value: Any, before: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        yield (*before, key)
        if isinstance(item, dict | list):
            yield from _paths(item, (*before, key))


def leaf_kinds(what: str, good: str, n: int, seed: int) -> list[Forgery]:
    """Return ``n`` kinds of a hostile document, each with one leaf replaced."""
    rng = np.random.default_rng(seed)
    document = tomllib.loads(good)
    paths = list(_paths(document))
    found: dict[str, Forgery] = {}
    wrong = {**WRONG, "5,000 digits": TOO_LONG_NUMBER, "left out": None}
    names = list(wrong)
    while len(found) < n:
        path = paths[int(rng.integers(0, len(paths)))]
        word = names[int(rng.integers(0, len(names)))]
        name = f"{what}, {'.'.join(map(str, path))} is {word}"
        if name in found:
            continue
        changed = copy.deepcopy(document)
        inner = changed
        for step in path[:-1]:
            inner = inner[step]
        if word == "left out":
            del inner[path[-1]]
        else:
            inner[path[-1]] = wrong[word]
        # Many values are valid in many places: only forbidden outcomes are checked.
        found[name] = Forgery(name, writes(as_toml(changed).encode("utf-8", "replace")), True)
    return list(found.values())


def writes(content: bytes) -> Callable[[Path, Path], int]:
    """Return the maker of a file with this content."""
    return lambda good, path: path.write_bytes(content)


def _as_text(what: str, good: str) -> Iterator[Forgery]:
    raw = good.encode()
    texts = {
        "empty": b"", "zeros": bytes(1000), "Latin-1": raw + "\n# Zoë µ\n".encode("latin-1"),
        "UTF-16": good.encode("utf-16"), "a byte order mark": b"\xef\xbb\xbf" + raw,
        "cut": raw[: len(raw) // 2], "twice": raw + b"\n" + raw, "no TOML": b"x y z\n1 2 3\n",
        "an integer of 5,000 digits": b"x = " + LONG_DIGITS.encode() + b"\n" + raw,
        "deep": b"x = " + DEEP.encode() + b"\n" + raw,
        "a deep table": b"[" + b"a." * 20_000 + b"b]\nx = 1\n",
        "a deep key": b"a." * 20_000 + b"b = 1\n" + raw,
        "many tables": b"".join(b"[t%d]\n" % k for k in range(100_000)),
        "5 MB": b"# " + b"x" * 5_000_000 + b"\n" + raw,
        "a surrogate": raw + b'\nx = "\xed\xa0\x80"',
        "a date": raw + b"\nx = 9999-99-99\n", "a zero": raw.replace(b'name = "', b'name = "\0', 1),
    }  # fmt: skip
    for name, content in texts.items():
        yield Forgery(f"{what}, {name}", writes(content), name in ("a byte order mark",))
    yield from _places(what)


def _places(what: str) -> Iterator[Forgery]:
    def sparse(good: Path, path: Path) -> None:
        path.write_bytes(b"x")
        os.truncate(path, 20 << 30)

    makers: dict[str, Callable[[Path, Path], object]] = {
        "a folder": lambda good, path: path.mkdir(),
        "a pipe": lambda good, path: os.mkfifo(path),
        "20 GB": sparse,
        "a device": lambda good, path: path.symlink_to("/dev/zero"),
        "a circle": lambda good, path: path.symlink_to(path),
        "nothing there": lambda good, path: None,
    }
    for name, make in makers.items():
        yield Forgery(f"{what}, {name}", make)


def points_kinds() -> list[Forgery]:
    rows = "\n".join(f"{x} {y} {0.001 * x * y}" for x in range(6) for y in range(6))
    texts = {
        "letters": "a b c\n" * 10, "two columns": "1 2\n" * 10, "many columns": "1 " * 100_000,
        "nan": rows + "\nnan nan nan\n", "inf": rows + "\n1e999 0 0\n", "1e308": "1e308 0 0\n" * 9,
        "long digits": f"{LONG_DIGITS} 0 0\n" * 9, "one point": "1 2 3\n", "markup": MARKUP,
        "the same point": "1 2 3\n" * 100, "a line": "".join(f"{k} 0 0\n" for k in range(50)),
        "underscores": "1_0 2 3\n" * 9, "other digits": "\u0661 2 3\n" * 9,
        "commas": "1,2,3,\n" * 9,
        "a long line": "1" * 1_000_000, "quotes": '"1","2\n' * 9, "zeros": "\0" * 100,
        "1e9": "1e9 1e9 1e9\n1e9 0 0\n0 1e9 0\n0 0 1e9\n", "tiny": rows.replace(" ", " 1e-300"),
        "a million rows": "1 2 3\n" * 1_000_000, "control codes": "\x1b[2J 1 2\n" * 9,
    }  # fmt: skip
    odd = {
        "the same point",
        "a line",
        "commas",
        "other digits",
        "1e9",
        "tiny",
        "nan",
        "a million rows",
    }
    return [
        *(Forgery(f"points, {k}", writes(v.encode()), k in odd) for k, v in texts.items()),
        Forgery("points, Latin-1", writes(("# Zoë\n" + rows).encode("latin-1")), True),
        Forgery("points, UTF-16", writes(rows.encode("utf-16")), True),
        Forgery("points, half of UTF-16", writes(rows.encode("utf-16")[:101]), True),
        *_places("points"),
    ]


def table_kinds() -> list[Forgery]:
    """Return kinds of hostile feature tables for the import into a plan."""
    head = "name,shape,x,y,z,diameter\n"
    good = head + "S1,Sphere,0,0,0,20\n"
    texts = {
        "empty": "", "only a head": head, "a quote": good + '"S2,Sphere', "markup": head + MARKUP,
        "a long cell": head + "x" * 1_000_000, "nan": good.replace("20", "nan"),
        "1e308": good.replace("20", "1e308"), "long digits": good.replace("20", LONG_DIGITS),
        "many columns": "name," * 50_000 + "\n", "the same column": "name,name\nA,B\n",
        "zeros": "\0" * 100,
        "many rows": head + "".join(f"S{k},Sphere,0,0,0,2\n" for k in range(99_999)),
        "another shape": good.replace("Sphere", "Donut"), "a formula": good.replace("S1", "=1+1"),
    }  # fmt: skip
    return [
        *(Forgery(f"table, {k}", writes(v.encode())) for k, v in texts.items()),
        Forgery(
            "table, Latin-1", writes(good.replace("S1", "Sé").encode("latin-1")), harmless=True
        ),
        *_places("table"),
    ]


def recording_kinds(good: bytes) -> list[Forgery]:
    """Return kinds of hostile recordings, from the bytes of a good one."""
    line, _, rest = good.partition(b"\n")
    head = json.loads(line)["head"]

    def headed(**changed: Any) -> bytes:
        new = {**head, **changed}
        whole = {"head": new, "crc32": zlib.crc32(json.dumps(new, separators=(",", ":")).encode())}
        return json.dumps(whole, separators=(",", ":")).encode() + b"\n" + rest

    kinds = [
        Forgery(f"recording, {key} is {word}", writes(headed(**{key: value})))
        for key in ("frame_period_ns", "cycle_period_ns", "n_slots")
        for word, value in (("0", 0), ("-1", -1), ("10**18", 10**18), ("a text", "x"),
                            ("10**400", 10**400), ("1.5", 1.5))
    ]  # fmt: skip
    for word, serials in {"none": [], "a hundred": [1] * 100, "the same": [1, 1], "-1": [-1, -2],
                          "10**30": [10**30, 2], "texts": ["a", "b"]}.items():  # fmt: skip
        kinds.append(
            Forgery(f"recording, serials are {word}", writes(headed(camera_serials=serials)))
        )
    kinds += [
        Forgery("recording, source is markup", writes(headed(source=MARKUP)), True),
        Forgery("recording, another time", writes(headed(started_utc="yesterday")), True),
        Forgery("recording, deep head", writes(b'{"head":' + DEEP.encode() + b"\n" + rest)),
        Forgery("recording, long digits",
                writes(b'{"head":' + LONG_DIGITS.encode() + b"}\n" + rest)),
        Forgery("recording, no line end", writes(b"x" * 1_000_000)),
        Forgery("recording, only a head", writes(line + b"\n"), True),
        Forgery("recording, cut", writes(good[: len(good) // 2]), True),
        Forgery("recording, empty", writes(b"")),
        Forgery("recording, magic everywhere", writes(line + b"\n" + b"OCRF" * 500_000), True),
        *(Forgery(f"recording, frames of {word}", writes(line + b"\n" + _filled(rest, fill)), True)
          for word, fill in (("zeros", b"\0"), ("ones", b"\xff"),
                             ("NaN", struct.pack("<d", math.nan)),
                             ("1e308", struct.pack("<d", 1e308)))),
        *_places("recording"),
    ]  # fmt: skip
    return kinds


def _filled(chunks: bytes, fill: bytes) -> bytes:
    """Return the same valid chunks with other frames in them."""
    out, at = [], 0
    chunk = struct.Struct("<4sIIII")
    while at + chunk.size <= len(chunks):
        magic, sequence, length, _, _ = chunk.unpack_from(chunks, at)
        payload = (fill * (length // len(fill) + 1))[:length]
        start = chunk.pack(magic, sequence, length, zlib.crc32(payload), 0)[:-4]
        out.append(start + struct.pack("<I", zlib.crc32(start)) + payload)
        at += chunk.size + length
    return b"".join(out)
