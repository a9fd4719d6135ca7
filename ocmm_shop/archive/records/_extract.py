"""Rows of a job, from its file alone: identical on every computer, with any keys.

Later findings are marks in the archive, not rows: a rebuilt archive has the same rows.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ocmm_core.calibration.records import record_hash
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import (
    ReopenedJob,
    StoredDocuments,
    reopen_alone,
    why_not_counted,
)
from ocmm_core.seals import SealWord
from ocmm_core.storage import JobFile, JobHead, JobSeal
from ocmm_core.tolerances.decisions import PartWord
from ocmm_core.tolerances.kinds import spec_of
from ocmm_shop.archive.records import _rows as rows


@dataclass(frozen=True, slots=True)
class ExtractedJob:
    """A job ready for delivery: its rows and the bytes of its file."""

    record: rows.JobRecord
    content: bytes


_CALLED = Path("/-/job.ocmm")
"""Placeholder of the file name in sentences, as names may be any text."""

Extract = Callable[[bytes, str, str, Mapping[int, str] | None], ExtractedJob]


def snapshot(path: Path) -> bytes:
    """Return a consistent snapshot of a job file; StorageError: missing, damaged, or changing."""
    with JobFile.read(path) as job:
        return job.content()


def extract_job(
    content: bytes, name: str, station: str, known: Mapping[int, str] | None = None
) -> ExtractedJob:
    """Return the rows of a job file.

    `known`: hash of the audit by its number of rows, of versions already archived by this station:
    a file that does not continue them was altered. OcmmError: no job file, damaged, or later.
    """
    with JobFile.in_memory(_CALLED, content) as file:
        head, seal = file.head, file.seal()
        chain = file.links() if known else {}
        try:
            job = reopen_alone(_CALLED, file)
        except OcmmError as error:
            # Searches for this job must show the fault.
            why = _sentence(error.what.replace(str(_CALLED), name))
            return ExtractedJob(_unreadable(head, seal, content, station, why), content)
        fault = _fault(job, chain, known or {}, str(_CALLED), name)
        return ExtractedJob(_record(job, content, station, fault), content)


def _unreadable(
    head: JobHead, seal: JobSeal, content: bytes, station: str, why: str
) -> rows.JobRecord:
    """Return the row of a job whose content was altered: no result of it counts."""
    row = _row(
        head, seal, content, station, steps=max(seal.steps, 1), head=seal.head or "0" * 64,
        state="open", order_name="", batch="", plan="",
        changed_utc=rows.utc_text(head.created_utc), rig="", calibration="", probe="", tip="",
        part_c=None, probe_c=None, verdict=PartWord.NOT_PROVEN.value, complete=False,
        simulated=False, points=0, fault=why or "The job cannot be read.",
    )  # fmt: skip
    return rows.JobRecord(job=row, results=(), uses=())


def _row(job: JobHead, seal: JobSeal, content: bytes, station: str, /, **own: Any) -> rows.JobRow:
    """Return the row of a job: what its head and seal say, and its ``own`` fields."""
    return rows.JobRow(
        job_uuid=job.job_uuid, sha256=hashlib.sha256(content).hexdigest(), size=len(content),
        station=station, part=_name(job.part), serial=_name(job.serial),
        operator=_name(job.operator), plan_sha256=job.plan_identity,
        program=_name(job.software_version), created_utc=rows.utc_text(job.created_utc),
        **_sealed(seal), **own,
    )  # fmt: skip


def _fault(
    job: ReopenedJob, chain: Mapping[int, str], known: Mapping[int, str], path: str, name: str
) -> str:
    if job.doubts:
        return _sentence(job.doubts[0].replace(path, name))
    for steps in sorted(known):
        if steps <= job.seal.steps and chain.get(steps) != known[steps]:
            return (
                f"Altered after it was archived: step {steps} is not the one that the archive has."
            )
    return ""


def _record(job: ReopenedJob, content: bytes, station: str, fault: str) -> rows.JobRecord:
    view, head = job.view, job.head
    documents = StoredDocuments(job.path, head)
    camera, probe = documents.camera_record(), documents.probe_records()
    times = [head.created_utc, *(event.time_utc for event in job.events), *job.taken_utc.values()]
    part, rod = job.options.climate.part.now, job.options.climate.probe.now
    row = _row(
        head,
        job.seal,
        content,
        station,
        steps=job.seal.steps,
        head=job.seal.head,
        state="finished" if view.complete else "paused" if view.paused else "open",
        order_name=_name(view.header.order),
        batch=_name(view.header.batch),
        plan=_name(job.plan.name),
        changed_utc=max(rows.utc_text(one) for one in times),
        rig=_name(job.rig.name),
        calibration="" if camera is None else record_hash(camera),
        probe=_name(job.body.name),
        tip="" if probe is None else _name(probe.calibration.tip),
        part_c=None if part is None else float(part.celsius),
        probe_c=None if rod is None else float(rod.celsius),
        verdict=view.part_verdict.word.value,
        complete=bool(view.part_verdict.complete),
        simulated=bool(view.simulated),
        points=len(job.points),
        fault=fault,
        requirements=_name(view.part_verdict.requirement_words),
    )
    results = []
    for position, result in enumerate(view.characteristics):
        stated = result.stated
        why = why_not_counted(job, result)
        one_sided = spec_of(result.kind).one_sided
        results.append(
            rows.ResultRow(
                position=position,
                characteristic=_name(result.name),
                kind=result.kind,
                unit=result.unit,
                nominal=float(result.nominal) + 0.0,
                low=None if one_sided else _limit(result.nominal + result.lower),
                high=_limit(result.nominal + result.upper),
                # SQLite does not store the sign of zero.
                value=None if stated is None else float(stated[0]) + 0.0,
                uncertainty=None if stated is None else float(stated[2]) + 0.0,
                verdict=result.verdict.value,
                why_not=_sentence(why or ("" if stated is not None else "Not measured.")),
            )
        )
    uses = [
        rows.UseRow(kind="rig", identity=head.rig_identity, name=_name(job.rig.name)),
        rows.UseRow(kind="probe", identity=head.probe_identity, name=_name(job.body.name)),
        rows.UseRow(kind="plan", identity=head.plan_identity, name=_name(job.plan.name)),
    ]
    artefacts: dict[str, str] = {}
    if camera is not None:
        uses.append(
            rows.UseRow(kind="calibration", identity=record_hash(camera), name=_name(camera.rig))
        )
        artefacts |= {one.serial: one.name for one in camera.artefacts if one.serial}
    if probe is not None:
        tip = record_hash(probe.calibration)
        uses.append(rows.UseRow(kind="tip", identity=tip, name=_name(probe.calibration.tip)))
        artefacts |= {one.serial: one.name for one in probe.calibration.artefacts if one.serial}
        if probe.qualification is not None:
            artefacts |= {
                one.serial: one.name for one in probe.qualification.artefacts if one.serial
            }
    uses += [
        rows.UseRow(kind="artefact", identity=_name(serial), name=_name(name))
        for serial, name in sorted(artefacts.items())
    ]
    body = job.options.reference
    if body is not None:
        uses.append(
            rows.UseRow(kind="reference", identity=body.identity, name=_name(body.leds.name))
        )
    ordered = tuple(sorted(uses, key=lambda use: (use.kind, use.identity)))
    return rows.JobRecord(job=row, results=tuple(results), uses=ordered)


def signature_of(content: bytes) -> tuple[str, str]:
    """Return public key and signature of the head of a job file; empty if it has none."""
    with JobFile.in_memory(_CALLED, content) as file:
        signed = file.seal().signature
    return ("", "") if signed is None else (signed.key, signed.value)


def _sealed(seal: JobSeal) -> dict[str, Any]:
    word = {SealWord.NOT_SIGNED: rows.NOT_SIGNED, SealWord.FORGED: rows.FORGED}.get(
        seal.state.word, rows.SIGNED
    )
    signed = seal.signature
    # A malformed key verifies nothing: a damaged row must not break the archive.
    key, value = ("", "") if signed is None or word == rows.FORGED else (signed.key, signed.value)
    return {"seal": word, "signer": seal.state.fingerprint, "key": key, "signature": value}


def _limit(value: float) -> float | None:
    return float(value) + 0.0 if math.isfinite(value) else None


def _name(text: str) -> str:
    """Return a displayable name; foreign job files hold any text."""
    return rows.shown_text(text)[: rows.LONGEST_NAME]


def _sentence(text: str) -> str:
    return rows.shown_text(text, " ")
