"""Hostile job files: wrong values, shapes, texts, tables and bytes."""

from __future__ import annotations

import contextlib
import math
import shutil
import sqlite3
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_bench.campaign._hostile_runs import DEEP, LONG_DIGITS, MARKUP, TABLES, Forgery, forged


def job_kinds() -> list[Forgery]:
    """Return all kinds of hostile job files except random damage."""
    return [*_values(), *_texts(), *_seals(), *_schemas(), *_bytes()]


def damaged_kinds(n: int, seed: int) -> list[Forgery]:
    """Return ``n`` jobs with random damage: bytes replaced, removed, doubled, zeroed."""
    return [
        Forgery(f"job, damage {index}", partial(_damage, seed=seed + index), True)
        for index in range(n)
    ]


def _set(table: str, column: str, value: Any, name: str, *, harmless: bool = False) -> Forgery:
    key = TABLES[table][0]

    def make(good: Path, path: Path) -> None:
        with forged(good, path) as db:
            which = f"(SELECT max({key}) FROM {table})"  # noqa: S608 - constants
            given = "CAST(? AS TEXT)" if name.endswith("(bad UTF-8)") else "?"
            statement = f"UPDATE {table} SET {column} = {given} WHERE {key} = {which}"  # noqa: S608 - constants
            db.execute(statement, (value,))
            if column == "number":
                last = "(SELECT max(key) FROM audit WHERE subject = 'observation')"
                db.execute(f"UPDATE audit SET key = ? WHERE key = {last}", (value,))  # noqa: S608 - a constant

    return Forgery(f"job, {table}.{column} {name}", make, harmless)


_WRONG_INTEGERS = {
    "-1": -1, "0": 0, "2**31": 2**31, "2**63 - 1": 2**63 - 1, "-2**63": -(2**63), "a text": "abc",
    "NULL": None, "a fraction": 1.5, "a blob": b"x",
}  # fmt: skip
_WRONG_REALS = {
    "inf": math.inf, "-inf": -math.inf, "1e308": 1e308, "-1.0": -1.0, "a text": "abc",
    "NULL": None, "a blob": b"\0" * 8, "an integer": 7,
}  # fmt: skip
_WRONG_TEXTS = {
    "NULL": None, "a number": 12, "a fraction": 0.5, "a blob": b"abc", "(bad UTF-8)": b"\xff\xfe",
}  # fmt: skip
_ODD_TEXTS = {"nothing": "", "a zero": "a\0b", "markup": MARKUP, "a megabyte": "x" * 1_000_000}


def _values() -> Iterator[Forgery]:
    for column in ("number", "first_frame", "last_frame", "n_frames"):
        for name, wrong in _WRONG_INTEGERS.items():
            if column != "number" or isinstance(wrong, int):
                harmless = (
                    (name == "0" and column == "first_frame")
                    or (column == "last_frame" and name in ("2**31",))
                    or (column == "n_frames" and name == "")
                )
                yield _set("observation", column, wrong, name, harmless=harmless)
    for column in ("time_s", "tip_radius", "chi2_per_dof"):
        for name, wrong in _WRONG_REALS.items():
            harmless = name == "an integer" or (column == "time_s" and name in ("1e308", "-1.0"))
            yield _set("observation", column, wrong, name, harmless=harmless)
    for column, size in (
        ("tip_world", 3), ("random_covariance", 9), ("direction", 3),
        ("rotation_world_from_probe", 9), ("spots", 16),
    ):  # fmt: skip
        for name, blob in {
            "empty": b"", "one byte": b"x", "a number short": bytes(8 * (size - 1)),
            "of NaN": np.full(size, math.nan).tobytes(),
            "of inf": np.full(size, math.inf).tobytes(),
            "of 1e308": np.full(size, 1e308).tobytes(), "a megabyte": bytes(1_000_000),
            "NULL": None, "a text": "x" * 8 * size, "of zeros": bytes(8 * size),
        }.items():  # fmt: skip
            yield _set("observation", column, blob, name, harmless=name in ("of zeros", "of NaN"))
    for shape in ("", "2", "2,4", "2,4,3", "-2,-4,2", "0,0,2", "99999999999999999999,1,2", "2,4,2,",
                  "a,b,c", "2.0,4,2", " 2,4,2", "4,2,2", "1,8,2", "999,999,2", LONG_DIGITS + ",1,2",
                  "\u0662,4,2"):  # fmt: skip
        yield _set("observation", "spots_shape", shape, f"{shape[:24]!r}")
    for column in ("feature", "approach"):
        for name, wrong in _WRONG_TEXTS.items():
            yield _set("observation", column, wrong, name)
        for name, wrong in _ODD_TEXTS.items():
            yield _set("observation", column, wrong, name, harmless=name != "a megabyte")
    yield _set("observation", "spots_shape", None, "NULL")


def _texts() -> Iterator[Forgery]:
    for column in TABLES["head"][1:]:
        for name, wrong in _WRONG_TEXTS.items():
            yield _set("head", column, wrong, name)
        harmless = column in ("job_uuid", "software_version", "operator", "part", "serial") or (
            column.endswith("sha256")
        )
        for name, odd in _ODD_TEXTS.items():
            yield _set("head", column, odd, name, harmless=harmless)
    for column in ("plan_text", "rig_text", "probe_text"):
        for name, text in {
            "deep": DEEP, "a deep record": '{"schema":' + "[" * 50_000,
            "long digits": f"schema = {LONG_DIGITS}", "deep tables": "a." * 20_000 + "b = 1",
            "JSON": '{"schema": "ocmm.camera-record/1"}', "a list": "[]",
        }.items():  # fmt: skip
            yield _set("head", column, text, name)
    for time_utc in ("yesterday", "9999-12-31T23:59:59-14:00", "2024-05-06T07:08:09", "0001-01-01"):
        yield _set("head", "created_utc", time_utc, repr(time_utc))
        yield _set("event", "time_utc", time_utc, repr(time_utc))
    for column in ("kind", "text", "time_utc"):
        for name, wrong in _WRONG_TEXTS.items():
            yield _set("event", column, wrong, name)
    for kind in (
        "limits",
        "header",
        "standing",
        "step",
        "temperature",
        "points held back",
        "restored",
    ):
        for name, text in {
            "nothing": "", "no JSON": "{", "deep": DEEP, "a list": "[]", "null": "null",
            "another field": '{"done": 1}', "long digits": f'{{"order": {LONG_DIGITS}}}',
            "1e999": '{"max_form": 1e999}', "markup": MARKUP, "NaN": "NaN",
        }.items():  # fmt: skip
            make = partial(_event, kind=kind, text=text)
            yield Forgery(f"job, event {kind!r} is {name}", make, kind in _FREE)
    for text in ("1 as 1", "2 as 1", "1 as 99999999999", "1 as 2\n"):
        make = partial(_event, kind="restored", text=text)
        yield Forgery(f"job, event 'restored' is {text!r}", make)
    limits = (
        '{"max_form":%s,"window_s":%s,"still_mm":0.05,"min_share":0.9,"approach_mm":3.0,'
        '"max_uncertainty":0.1,"method":"gauss-newton"}'
    )
    for limit in ("-1", "0", "1e308", "1e-320", "123456789012345678901234567890"):
        for name, both in (("max_form", (limit, "0.3")), ("window_s", ("0.5", limit))):
            make = partial(_event, kind="limits", text=limits % both)
            yield Forgery(f"job, limit {name} {limit}", make, True)


def _seals() -> Iterator[Forgery]:
    for name, wrong in _WRONG_INTEGERS.items():
        if isinstance(wrong, int):
            yield _set("seal", "sequence", wrong, name)
    for column in ("key", "signature"):
        for name, wrong in {**_WRONG_TEXTS, **_ODD_TEXTS}.items():
            yield _set("seal", column, wrong, name)
        for name, text in {
            "30 MB": "A" * (30 << 20), "no Base64": "?" * (44 if column == "key" else 88),
            "of zeros": "A" * (43 if column == "key" else 86) + "=" * (1 if column == "key" else 2),
            "not ASCII": "\u0662" * (44 if column == "key" else 88),
        }.items():  # fmt: skip
            # Of the right length, it is a signature by an unknown key: the job opens with a
            # warning.
            yield _set("seal", column, text, name, harmless=name != "30 MB")
    for many, length in ((200_000, 44), (3, 9_000_000)):
        make = partial(_more_seals, many=many, length=length)
        yield Forgery(f"job, {many} signatures more of {length} signs", make)


def _more_seals(good: Path, path: Path, many: int, length: int) -> None:
    with forged(good, path) as db:
        (last,) = db.execute("SELECT max(sequence) FROM audit").fetchone()
        db.execute("BEGIN")
        db.executemany(
            "INSERT INTO seal VALUES (?, ?, ?)",
            ((last + k, "A" * length, "A" * 2 * length) for k in range(1, many + 1)),
        )
        db.execute("COMMIT")


_FREE = ("header",)
"""Kinds of events in which unknown fields are allowed."""


def _event(good: Path, path: Path, kind: str, text: str) -> None:
    with forged(good, path) as db:
        (last,) = db.execute("SELECT max(id) FROM event").fetchone()
        (sequence,) = db.execute("SELECT max(sequence) FROM audit").fetchone()
        when = "2026-03-02T07:08:09.123456+00:00"
        db.execute("INSERT INTO event VALUES (?, ?, ?, ?)", (last + 1, when, kind, text))
        link = (sequence + 1, when, "event", last + 1, "", "", "")
        db.execute("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?)", link)


_RECURSION = (
    "WITH RECURSIVE more(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM more) "
    "SELECT {columns} FROM more"
)


def _schemas() -> Iterator[Forgery]:
    for table in ("head", "observation", "annulment", "event", "audit"):
        columns = TABLES.get(
            table, ("sequence", "time_utc", "subject", "key", "content_sha256", "previous", "hash")
        )
        view = _RECURSION.format(columns=", ".join(f"n AS {c}" for c in columns))
        yield _statements(f"view that never ends in the place of {table}", f"DROP TABLE {table}",
                          f"CREATE VIEW {table} AS {view}")  # fmt: skip
        yield _statements(f"no table {table}", f"DROP TABLE {table}")
        yield _statements(f"another column in {table}", f"ALTER TABLE {table} ADD COLUMN odd TEXT")
        yield _statements(
            f"a computed column in {table}",
            f"ALTER TABLE {table} ADD COLUMN odd BLOB AS (zeroblob(1000000000))",
        )
        yield _statements(f"another name of {table}", f"ALTER TABLE {table} RENAME TO odd")
    yield _statements("a trigger more", "CREATE TRIGGER odd AFTER INSERT ON event BEGIN "
                      "SELECT randomblob(1000000000); END")  # fmt: skip
    yield _statements("a table more", "CREATE TABLE odd (a)")
    yield _statements("a virtual table", "CREATE VIRTUAL TABLE odd USING fts5(a)")
    yield _statements("an index with an expression", "CREATE INDEX odd ON event (abs(id))")
    for version in (-1, 0, 1, 99, 2**31 - 1):
        yield _statements(f"version {version}", f"PRAGMA user_version = {version}")
    yield _statements("another application", "PRAGMA application_id = 1")


def _statements(name: str, *statements: str) -> Forgery:
    def make(good: Path, path: Path) -> None:
        shutil.copyfile(good, path)
        with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as db:
            db.execute("PRAGMA foreign_keys = OFF")
            for statement in statements:
                db.execute(statement)

    return Forgery(f"job, {name}", make)


def _bytes() -> Iterator[Forgery]:
    def cut(good: Path, path: Path, share: float) -> None:
        content = good.read_bytes()
        path.write_bytes(content[: int(share * len(content))])

    def header(good: Path, path: Path, at: int, content: bytes) -> None:
        whole = bytearray(good.read_bytes())
        whole[at : at + len(content)] = content
        path.write_bytes(whole)

    for share in (0.0, 0.01, 0.5, 0.99):
        # The last page may be cut if it is empty.
        yield Forgery(f"job, {share:.0%} of it", partial(cut, share=share), share == 0.99)
    for at, content in (
        (16, b"\0\0"), (16, b"\x00\x03"), (18, b"\xff\xff"), (20, b"\xff"), (44, b"\0\0\0\x09"),
        (56, b"\0\0\0\x02"), (100, b"\x02"), (103, b"\xff\xff"),
    ):  # fmt: skip
        make = partial(header, at=at, content=content)
        yield Forgery(f"job, byte {at} is {content.hex()}", make, at in (18, 56))

    def sparse(good: Path, path: Path) -> None:
        shutil.copyfile(good, path)
        with path.open("r+b") as stream:
            stream.truncate(20 << 30)

    def log(good: Path, path: Path) -> None:
        shutil.copyfile(good, path)
        path.with_name(f"{path.name}-wal").write_bytes(bytes(100_000))

    yield Forgery("job, 20 GB that are not there", sparse)
    yield Forgery("job, a folder", lambda good, path: path.mkdir())
    yield Forgery("job, a log of zeros", log, True)


def _damage(good: Path, path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    content = bytearray(good.read_bytes())
    for _ in range(int(rng.integers(1, 12))):
        at, size = int(rng.integers(0, len(content))), int(10 ** rng.uniform(0.0, 3.5))
        way = int(rng.integers(0, 5))
        if way == 0:
            content[at] ^= 1 << int(rng.integers(0, 8))
        elif way == 1:
            content[at : at + size] = rng.bytes(len(content[at : at + size]))
        elif way == 2:
            content[at : at + size] = bytes(len(content[at : at + size]))
        elif way == 3:
            del content[at : at + size]
        else:
            other = int(rng.integers(0, len(content)))
            piece = bytes(content[other : other + size])
            content[at : at + len(piece)] = piece
    path.write_bytes(content)
