"""Forged records, registers, plans, templates, settings and certificates: none may pass.

A forger has every file and no key of the station. Each trial edits one field of one file (all
fields in turn, in a seeded order), recomputes every hash, and then keeps the signature, removes
it, takes one of another file, or signs with a key of another station. Chains are also cut at the
end, and files of one kind are put in place of another. If a later version was made, the older one
is put back with its good signature, in place or in another folder behind a link. A forgery passes
if `export.audits` calls it intact, if a certificate is made of it, or if a test, a study or a
release accepts it.
The untouched files are audited between the trials and must stay intact.
Run: ``python -m benchmarks.forged_records --n 5000``.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
from typer.testing import CliRunner

from benchmarks.record_edits import (
    Kind,
    certificate_edit,
    chain_edit,
    record_edit,
    released_edit,
    settings_edit,
)
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
from ocmm_core.inspection.finished import RecallRecord
from ocmm_core.inspection.plan import plan_release, release_plan
from ocmm_core.seals import Signed, release_file
from ocmm_core.settings import SettingsFile
from ocmm_shop.studies import CalibratedPart, load_part_study, make_part_study, save_part_study

TRIALS = 5_000
NOW = datetime(2026, 11, 28, 8, 0, tzinfo=UTC)
LATER = datetime(2036, 1, 1, tzinfo=UTC)


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
            (25.0 + 0.001 * np.sin(np.arange(20.0))).tolist(), task,
            CalibratedPart("P-1", 25.0, 0.0016), characteristic="BORE", made_by="Ada", now=NOW,
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

    older = {
        path: _files(path)
        for path in (
            plan,
            template,
            procedure,
            settings.path,
            register.path,
            folder / "interim.chain",
        )
    }
    _make_later(plan, (template, procedure), settings, register, interim)

    def certified(path: Path) -> bool:
        return bool(certificate_of_folder(path, paper))

    def usable(path: Path) -> bool:
        found = ArtefactRegister(path.parent)
        return any(found.used(name).sizes for name in found.entries)

    kinds = (
        Kind("acceptance record", record, Signed.ACCEPTANCE, record_edit, certified),
        Kind("acceptance session", session, Signed.TEST, chain_edit),
        Kind("study", study, Signed.STUDY, record_edit, lambda p: load_part_study(p).signer.sound),
        Kind("recall", recall, Signed.RECALL, record_edit),
        Kind("artefact register", register.path, Signed.ARTEFACTS, chain_edit, usable),
        Kind("interim checks", folder / "interim.chain", Signed.INTERIM, chain_edit),
        Kind("plan", plan, Signed.PLAN, released_edit, lambda p: plan_release(p).released),
        Kind("template", template, Signed.TEMPLATE, released_edit),
        Kind("procedure", procedure, Signed.DOCUMENT, released_edit),
        Kind("settings", settings.path, Signed.SETTINGS, settings_edit),
        Kind("certificate", dcc, Signed.CERTIFICATE, certificate_edit),
    )
    return tuple(replace(kind, older=older.get(kind.path, {})) for kind in kinds)


def _files(path: Path) -> Mapping[Path, bytes]:
    """Return a file and those next to it that bear its name."""
    return {one: one.read_bytes() for one in path.parent.glob(f"{path.name}*")}


def _make_later(
    plan: Path,
    documents: tuple[Path, ...],
    settings: SettingsFile,
    register: ArtefactRegister,
    interim: InterimHistory,
) -> None:
    """Make a later version of every kind that has versions."""
    for document in (plan, *documents):
        document.write_text(document.read_text("utf-8") + "# later\n", "utf-8")
        if document is not plan:
            release_file(document, document_kind(document), "Grace")
    release_plan(plan, "Grace", "revision D")
    entry = load_artefact(resource("artefacts", "acceptance_sphere.toml"))
    register.add(msgspec.structs.replace(entry, id="later"), "Ada", NOW)
    interim.add(
        InterimCheck(
            utc="2026-11-27T08:00:00+00:00", calibration="c", artefact="s", tip="t",
            error_mm=0.9, limit_mm=0.02,
        )
    )  # fmt: skip
    settings.change({"temperature.part_c": 22.0}, stamp="2026-11-28")
    settings.change({"temperature.part_c": 21.0}, stamp="2026-11-28")


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
        if number % 5 == 3 and kind.older:
            forged = {**dict.fromkeys(_files(kind.path)), **kind.older}
        if number % 10 == 8 and kind.older:
            count.done[kind.name] += 1
            if passes := _passes(_behind_link(kind, folder), honest[kind.name]):
                count.passed.append(f"trial {number}, {kind.name} elsewhere: {passes}")
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


def _behind_link(kind: Kind, folder: Path) -> Kind:
    """Return a kind whose older version is in another folder, behind a link."""
    there, link = folder / "elsewhere", folder / "linked"
    shutil.rmtree(there, ignore_errors=True)
    there.mkdir()
    for path, content in kind.older.items():
        (there / path.name).write_bytes(content)
    link.unlink(missing_ok=True)
    link.symlink_to(there, target_is_directory=True)
    return replace(kind, path=link / kind.path.name)


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
