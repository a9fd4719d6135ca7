"""Made rows of jobs, and real job files, for tests of the archive."""

from __future__ import annotations

import hashlib
import uuid
from datetime import UTC, datetime, timedelta

import msgspec
import numpy as np

from ocmm_core.seals import KeyFolder, Signed, sign
from ocmm_shop.archive.records import (
    Delivery,
    JobRecord,
    JobRow,
    ResultRow,
    Sender,
    UseRow,
    utc_text,
)

START = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)


def made_sender(station: str = "Station 1", number: int = 1) -> Sender:
    return Sender(
        outbox=str(uuid.UUID(int=number)), station=station, machine=f"machine {number}",
        host=f"host{number}", user="inspector",
    )  # fmt: skip


def made_record(
    seed: int, station: str = "Station 1", *, content: bytes = b"", results: int = 3
) -> JobRecord:
    """Return rows of an invented job; the same seed gives the same ones."""
    rng = np.random.default_rng(seed)
    created = utc_text((START + timedelta(minutes=7 * seed)).isoformat())
    content = content or content_of(seed)
    rows = tuple(
        ResultRow(
            position=i, characteristic=f"D{i}", kind="diameter", unit="mm", nominal=20.0 + i,
            low=19.9 + i, high=20.1 + i, value=float(20.0 + i + rng.normal(0.0, 0.02)),
            uncertainty=0.008, verdict="CONFORM", why_not="",
        )
        for i in range(results)
    )  # fmt: skip
    job = JobRow(
        job_uuid=str(uuid.UUID(int=1_000_000 + seed)), steps=10, head=_hex(f"head {seed}"),
        sha256=hashlib.sha256(content).hexdigest(), size=len(content), station=station,
        state="finished", part="FLANGE", serial=f"{seed:05d}", order_name="O-1", batch="B-1",
        operator=("Anna", "Ben", "Cleo")[seed % 3], plan="flange", plan_sha256=_hex("plan"),
        program="0.1.0", created_utc=created, changed_utc=created, rig="hall3",
        calibration=_hex("calibration"), probe="standard", tip="T1", part_c=20.5, probe_c=None,
        verdict="PART CONFORMS", complete=True, simulated=False, points=91, seal="SIGNED",
        signer="", fault="",
    )  # fmt: skip
    job = signed_row(job)
    uses = tuple(
        sorted(
            (
                UseRow(kind="calibration", identity=_hex("calibration"), name="hall3"),
                UseRow(kind="tip", identity=_hex("tip"), name="T1"),
                UseRow(kind="artefact", identity="B-17", name="bar"),
            ),
            key=lambda use: (use.kind, use.identity),
        )
    )
    return JobRecord(job=job, results=rows, uses=uses)


def content_of(seed: int) -> bytes:
    return b"job file %d" % seed


def made_delivery(
    seed: int, sender: Sender | None = None, *, sequence: int | None = None, **job: object
) -> Delivery:
    sender = sender or made_sender()
    record = made_record(seed, sender.station)
    if job:
        row = signed_row(msgspec.structs.replace(record.job, **job))
        record = msgspec.structs.replace(record, job=row)
    return Delivery(
        sender=sender, sequence=sequence or seed + 1,
        sent_utc=datetime.now(UTC).isoformat(), record=record, content=content_of(seed),
    )  # fmt: skip


def signed_row(job: JobRow, keys: KeyFolder | None = None) -> JobRow:
    """Return a row with the signature of its head, by the key of this user or another one."""
    key = (keys or KeyFolder()).station_key()
    signature = sign(key, Signed.JOB, b"%d %s" % (job.steps, job.head.encode()))
    return msgspec.structs.replace(
        job, key=signature.key, signature=signature.value, signer=key.fingerprint
    )


def _hex(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
