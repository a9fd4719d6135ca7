"""Forgeries of one signed file: one field edited, all hashes recomputed; see `forged_records`."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from lxml import etree
from signxml import methods
from signxml.xades.xades import XAdESSigner

from ocmm_bench.campaign import other_station
from ocmm_core.seals import KeyFolder, Signed, document_key, sign

Rng = np.random.Generator
SIGNATURES = ("kept", "removed", "of another", "foreign")


@dataclass(frozen=True, slots=True)
class Kind:
    """A sealed file, with the forgeries of it."""

    name: str
    path: Path
    signed: Signed
    forge: Callable[[Kind, Rng, int], Mapping[Path, bytes | None]]
    """Files of trial number n: their contents, or None for a removed one."""
    accepted: Callable[[Path], bool] = lambda _path: False
    """Whether another door than the audit accepts the file."""
    older: Mapping[Path, bytes] = field(default_factory=dict)
    """Files of the version before; empty if the kind has no versions."""


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items: Any = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    elif value is not None:
        yield path
    for key, item in items:
        yield from _leaves(item, (*path, key))


def _edited(content: Any, rng: Rng, number: int) -> Any:
    """Return a content with one field changed: each field in turn, the fields that lie first."""
    leaves = sorted(_leaves(content), key=lambda path: (len(path), str(path)))
    *steps, last = leaves[number % len(leaves)]
    place = content
    for step in steps:
        place = place[step]
    old = place[last]
    if isinstance(old, bool):
        place[last] = not old
    elif isinstance(old, int | float):
        place[last] = old + type(old)(1 + rng.integers(9)) * (1 if isinstance(old, int) else 0.001)
    else:
        place[last] = "Mallory" if old != "Mallory" else ""
    return content


def _signature(kind: Kind, how: str, content: bytes, kept: Any, other: Any) -> Any:
    if how == "foreign":
        with other_station(kind.path.parent / "stranger"):
            return msgspec.to_builtins(sign(KeyFolder().station_key(), kind.signed, content))
    return {"kept": kept, "removed": None, "of another": other}[how]


def record_edit(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    """Return a record of one JSON document with a field edited."""
    file = msgspec.json.decode(kind.path.read_bytes())
    content = _edited(file["content"], rng, number)
    raw = msgspec.json.encode(content, order="sorted")
    how = SIGNATURES[int(rng.integers(len(SIGNATURES)))]
    stolen = sign(KeyFolder().station_key(), Signed.REPORT, raw)
    signature = _signature(kind, how, raw, file["signature"], msgspec.to_builtins(stolen))
    end = b"" if signature is None else b',"signature":' + msgspec.json.encode(signature)
    digest = hashlib.sha256(raw).hexdigest().encode()
    return {kind.path: b'{"content":' + raw + b',"sha256":"' + digest + b'"' + end + b"}"}


def chain_edit(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    """Return a chain with a field of a line edited, a line removed, or its end cut."""
    lines = [msgspec.json.decode(line) for line in kind.path.read_bytes().splitlines()]
    how = (*SIGNATURES, "cut", "line out")[int(rng.integers(6))]
    if how == "cut":
        lines = lines[: int(rng.integers(1, len(lines)))]
        return {kind.path: b"".join(msgspec.json.encode(one) + b"\n" for one in lines)}
    if how == "line out":
        del lines[int(rng.integers(len(lines)))]
    else:
        at = int(rng.integers(len(lines)))
        lines[at]["item"] = _edited(lines[at]["item"], rng, number)
    end, made = "0" * 64, []
    for place, line in enumerate(lines, start=1):
        item = msgspec.json.encode(line["item"])
        link = hashlib.sha256(b"%d %s " % (place, end.encode()) + item).hexdigest()
        other = lines[place % len(lines)].get("signature")
        signature = _signature(
            kind, "kept" if how == "line out" else how, link.encode(), line["signature"], other
        )
        text = b'{"number":%d,"previous":"%s","item":%s,"sha256":"%s"' % (
            place, end.encode(), item, link.encode()
        )  # fmt: skip
        end = link
        if signature is not None:
            text += b',"signature":' + msgspec.json.encode(signature)
            end = hashlib.sha256(f"{link} {signature['value']}".encode()).hexdigest()
        made.append(text + b"}\n")
    return {kind.path: b"".join(made)}


def _digit(text: str, rng: Rng) -> str:
    """Return a document with one digit, or one letter of a value, changed."""
    places = [found.start() for found in re.finditer(r"(?<==)[^\n#]*?([0-9A-Za-z])", text)]
    at = places[int(rng.integers(len(places)))]
    signs = [i for i in range(at, text.find("\n", at)) if text[i].isalnum()]
    chosen = signs[int(rng.integers(len(signs)))]
    new = "7" if text[chosen] != "7" else "1"
    return text[:chosen] + new + text[chosen + 1 :]


def released_edit(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    """Return a document or its release with a sign edited, or the release of another file."""
    beside = kind.path.with_name(kind.path.name + ".release.json")
    text, release = kind.path.read_text("utf-8"), msgspec.json.decode(beside.read_bytes())
    how = (*SIGNATURES, "release edited", "of another file")[int(rng.integers(6))]
    if how == "of another file":
        others = [p for p in kind.path.parent.glob("*.release.json") if p != beside]
        return {beside: others[number % len(others)].read_bytes()}
    if how == "release edited":
        return {beside: msgspec.json.encode(_edited(release, rng, number))}
    changed = _digit(text, rng).encode()
    release["sha256"] = hashlib.sha256(changed).hexdigest()
    signature = release["signature"]
    content = msgspec.json.encode({**release, "signature": None}, order="sorted")
    release["signature"] = _signature(kind, how, content, signature, signature)
    gone = how == "removed" and bool(rng.integers(2))
    return {kind.path: changed, beside: None if gone else msgspec.json.encode(release)}


def settings_edit(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    """Return settings with a value edited."""
    text = kind.path.read_text("utf-8")
    head, _, seal = text.partition("[seal]")
    how = SIGNATURES[int(rng.integers(len(SIGNATURES)))]
    body = head.replace("part_c = 21.0", f"part_c = {22 + number % 30}.0")
    if number % 3 == 0:
        body = head.replace("released_only = true", "released_only = false")
    if number % 5 == 0:
        body += "\n[instrument]\ncheck_after_h = 99.0\n"
    if how == "removed":
        return {kind.path: body.encode()}
    table = tomllib.loads(f"[seal]{seal}")["seal"]
    if how == "foreign":
        entries = tomllib.loads(body)
        values = {
            f"{section}.{name}": value
            for section, items in entries.items()
            if isinstance(items, dict)
            for name, value in items.items()
        }
        names = ("who", "utc", "id", "number")
        content = {"settings": values, **{name: table[name] for name in names}}
        made = _signature(kind, how, msgspec.json.encode(content, order="sorted"), None, None)
        table = {**table, **made}
    if how == "of another":
        body, table = head, {**table, "who": "Mallory"}
    # A JSON text or number is one of TOML.
    lines = "\n".join(f"{name} = {json.dumps(value)}" for name, value in table.items())
    return {kind.path: f"{body}\n[seal]\n{lines}\n".encode()}


def certificate_edit(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    """Return a certificate with a sign edited."""
    beside = kind.path.with_name(kind.path.name + ".sig.json")
    text, signed, end = kind.path.read_text("utf-8").partition("<ds:Signature ")
    places = [found.start() + 1 for found in re.finditer(r">[^<>\s]", text)]
    at = places[number % len(places)]
    text = text[:at] + ("7" if text[at] != "7" else "1") + text[at + 1 :]
    how = SIGNATURES[int(rng.integers(len(SIGNATURES)))]
    if how == "kept":
        return {kind.path: f"{text}{signed}{end}".encode()}
    bare = f"{text}</dcc:digitalCalibrationCertificate>".encode()
    if how == "removed":
        return {kind.path: bare}
    if how == "foreign":
        with other_station(kind.path.parent / "stranger"):
            key = document_key(KeyFolder().station_key(), "forged")
        maker = XAdESSigner(method=methods.enveloped, signature_algorithm="ecdsa-sha256")
        made = maker.sign(etree.fromstring(bare), key=key.private, cert=list(key.chain))
        return {kind.path: etree.tostring(made)}
    # A detached signature, as versions before 2026-11-28 wrote it.
    file = {
        "schema": "ocmm.certificate-seal/1", "number": "V-1",
        "signature": msgspec.to_builtins(sign(KeyFolder().station_key(), Signed.JOB, bare)),
    }  # fmt: skip
    return {kind.path: bare, beside: msgspec.json.encode(file)}
