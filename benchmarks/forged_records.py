"""Forged records, registers, plans, templates, settings and certificates: none may pass.

A forger has every file and no key of the station. Each trial edits one field of one file (all
fields in turn, in a seeded order), recomputes every hash, and then keeps the signature, removes
it, takes one of another file, or signs with a key of another station. Chains are also cut at the
end, and files of one kind are put in place of another. A forgery passes if `export.audits` calls it
intact, if a certificate is made of it, or if a test, a study or a release accepts it.
The untouched files are audited between the trials and must stay intact.
Run: ``python -m benchmarks.forged_records --n 5000``.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import shutil
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from lxml import etree
from signxml import methods
from signxml.xades.xades import XAdESSigner
from typer.testing import CliRunner

from ocmm_bench.campaign import other_station
from ocmm_cli import app
from ocmm_core.acceptance import (
    ArtefactRegister,
    InterimCheck,
    InterimHistory,
    PartTask,
    load_artefact,
)
from ocmm_core.calibration.records import seal_signed
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.export.audits import AuditedKind, audit, document_kind
from ocmm_core.export.certificate import certificate_of_folder, write_certificate
from ocmm_core.export.template import load_paper, standard_template
from ocmm_core.inspection.archive import RecallRecord
from ocmm_core.inspection.plan import plan_release, release_plan
from ocmm_core.seals import KeyFolder, Signed, document_key, release_file, sign
from ocmm_core.settings import SettingsFile
from ocmm_shop.studies import load_part_study, make_part_study, save_part_study

TRIALS = 5_000
NOW = datetime(2026, 11, 28, 8, 0, tzinfo=UTC)
LATER = datetime(2036, 1, 1, tzinfo=UTC)
Rng = np.random.Generator
Edits = Iterator[bytes]
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


@dataclass(slots=True)
class Count:
    """Trials by kind, and the forgeries that passed."""

    done: Counter[str] = field(default_factory=Counter)
    passed: list[str] = field(default_factory=list)
    accused: list[str] = field(default_factory=list)


def make_site(folder: Path, test: str = "SPHERE-25") -> tuple[Kind, ...]:
    """Return one file of every kind, made by the product."""
    paper = load_paper(standard_template())
    tests = folder / "tests"
    told = CliRunner().invoke(
        app, ["acceptance", "run", test, "--who", "Ada", "--folder", str(tests)]
    )
    (record,) = (tests / "records").glob("*.json")
    (session,) = (tests / "sessions").glob("*.chain")
    if told.exit_code > 1:
        raise SystemExit(told.output)
    task = PartTask(
        dimension=25.0, points=9, strategy="circle", stylus="6", material="steel", clamping="vice"
    )
    study = save_part_study(
        folder,
        make_part_study(
            (25.0 + 0.001 * np.sin(np.arange(20.0))).tolist(), task, characteristic="BORE",
            certificate="P-1", certified=25.0, expanded_cal=0.0016, made_by="Ada", now=NOW,
            simulated=True,
        ),
    )  # fmt: skip
    recall = folder / "recall.json"
    empty = RecallRecord(
        schema="ocmm.recall/1", made_utc="2026-11-28T08:00:00+00:00", made_by="Ada",
        software="1", folders=("jobs",), looked_at=1, jobs=(), unread=("a",),
    )  # fmt: skip
    recall.write_bytes(seal_signed(empty, Signed.RECALL))
    register = ArtefactRegister(folder / "register")
    for number in range(3):
        entry = load_artefact(resource("artefacts", "acceptance_sphere.toml"))
        register.add(msgspec.structs.replace(entry, id=f"s{number}"), "Ada", NOW)
    interim = InterimHistory(folder)
    for number in range(4):
        interim.add(
            InterimCheck(
                utc=f"2026-11-2{number}T08:00:00+00:00", calibration="c", artefact="s", tip="t",
                error_mm=0.001 * number, limit_mm=0.02,
            )
        )  # fmt: skip
    plan, template = folder / "plan.toml", folder / "template.toml"
    shutil.copy(resource("plans", "quick.toml"), plan)
    shutil.copy(standard_template(), template)
    procedure = folder / "procedure.toml"
    shutil.copy(resource("acceptance", "sphere_25.toml"), procedure)
    release_plan(plan, "Grace", "revision C")
    for document in (template, procedure):
        release_file(document, document_kind(document), "Grace")
    settings = SettingsFile(folder / "settings.toml")
    settings.change({"temperature.part_c": 21.0, "job.released_only": True}, stamp="2026-11-28")
    dcc = write_certificate(certificate_of_folder(record, paper), folder)

    def certified(path: Path) -> bool:
        return bool(certificate_of_folder(path, paper))

    def usable(path: Path) -> bool:
        found = ArtefactRegister(path.parent)
        return any(found.used(name).sizes for name in found.entries)

    return (
        Kind("acceptance record", record, Signed.ACCEPTANCE, _record, certified),
        Kind("acceptance session", session, Signed.TEST, _chain),
        Kind("study", study, Signed.STUDY, _record, lambda p: load_part_study(p).signer.sound),
        Kind("recall", recall, Signed.RECALL, _record),
        Kind("artefact register", register.path, Signed.ARTEFACTS, _chain, usable),
        Kind("interim checks", folder / "interim.chain", Signed.INTERIM, _chain),
        Kind("plan", plan, Signed.PLAN, _released, lambda p: plan_release(p).released),
        Kind("template", template, Signed.TEMPLATE, _released),
        Kind("procedure", procedure, Signed.DOCUMENT, _released),
        Kind("settings", settings.path, Signed.SETTINGS, _settings),
        Kind("certificate", dcc, Signed.CERTIFICATE, _certificate),
    )


def run(trials: int, seed: int, folder: Path, test: str = "SPHERE-25") -> Count:
    """Return what became of forgeries of all kinds in turn."""
    kinds, rng, count = make_site(folder, test), np.random.default_rng(seed), Count()
    honest = {kind.name: audit(kind.path).kind for kind in kinds}
    for number in range(trials):
        kind = kinds[number % len(kinds)]
        forged = dict(kind.forge(kind, rng, number // len(kinds)))
        if number % 25 == 24:
            other = kinds[int(rng.integers(len(kinds)))]
            forged = {kind.path: other.path.read_bytes()} if other is not kind else forged
        kept = {path: path.read_bytes() for path in forged if path.exists()}
        for path, content in forged.items():
            path.unlink(missing_ok=True)
            if content is not None:
                path.write_bytes(content)
        if {path: path.read_bytes() for path in forged if path.exists()} != kept:
            count.done[kind.name] += 1
            passes = _passes(kind, honest[kind.name])
            if passes:
                count.passed.append(f"trial {number}, {kind.name}: {passes}")
        for path in forged:
            path.unlink(missing_ok=True)
        for path, content in kept.items():
            path.write_bytes(content)
        if not audit(kind.path).intact:
            count.accused.append(f"trial {number}, {kind.name}")
    return count


def _passes(kind: Kind, honest: AuditedKind) -> str:
    """Return which door lets a forgery pass; empty if none does."""
    try:
        found = audit(kind.path)
        # A whole file of another kind is named by its own kind.
        if found.intact and found.kind is honest:
            return "audit"
    except OcmmError:
        pass
    try:
        return "another door" if kind.accepted(kind.path) else ""
    except OcmmError:
        return ""


# Edits of one field.


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


def _record(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
    file = msgspec.json.decode(kind.path.read_bytes())
    content = _edited(file["content"], rng, number)
    raw = msgspec.json.encode(content, order="sorted")
    how = SIGNATURES[int(rng.integers(len(SIGNATURES)))]
    stolen = sign(KeyFolder().station_key(), Signed.REPORT, raw)
    signature = _signature(kind, how, raw, file["signature"], msgspec.to_builtins(stolen))
    end = b"" if signature is None else b',"signature":' + msgspec.json.encode(signature)
    digest = hashlib.sha256(raw).hexdigest().encode()
    return {kind.path: b'{"content":' + raw + b',"sha256":"' + digest + b'"' + end + b"}"}


def _chain(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
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


def _released(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
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


def _settings(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
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
        content = {"settings": values, "who": table["who"], "utc": table["utc"]}
        made = _signature(kind, how, msgspec.json.encode(content, order="sorted"), None, None)
        table = {**table, **made}
    if how == "of another":
        body, table = head, {**table, "who": "Mallory"}
    lines = "\n".join(f'{name} = "{value}"' for name, value in table.items())
    return {kind.path: f"{body}\n[seal]\n{lines}\n".encode()}


def _certificate(kind: Kind, rng: Rng, number: int) -> Mapping[Path, bytes | None]:
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


def main(arguments: list[str] | None = None) -> int:
    """Run, print the findings, and return 1 if a forgery passed or an honest file did not."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--n", type=int, default=TRIALS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder, other_station(Path(folder) / "home"):
        count = run(given.n, given.seed, Path(folder))
    total = sum(count.done.values())
    for name, number in sorted(count.done.items()):
        print(f"{number:6}  {name}")
    print(f"{total} forgeries: {len(count.passed)} passed (3/N {3 / total:.1e})")
    print(f"{len(count.accused)} of {given.n} honest files accused")
    for line in (*count.passed[:20], *count.accused[:20]):
        print(line)
    return 1 if count.passed or count.accused else 0


if __name__ == "__main__":
    sys.exit(main())
