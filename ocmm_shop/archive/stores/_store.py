"""Write methods common to both stores: rows are only ever added.

A resumed job is a new version, a finding a mark: stations need no right to change. Keys of stations
are registered by proof of possession, regardless of rows.
"""

from __future__ import annotations

import contextlib
import hashlib
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import cast

from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.seals import KeptKeys, SealWord, Signature, Signed, judge_signature
from ocmm_shop.archive import records
from ocmm_shop.archive.stores import _faults as faults
from ocmm_shop.archive.stores import _reader as reader
from ocmm_shop.archive.stores._interface import Acknowledgement, Cell, Receipt
from ocmm_shop.archive.stores._schema import SIGNATURES_SINCE


@dataclass(slots=True)
class _Rows:
    """Pending rows of many jobs."""

    results: list[dict[str, Cell]] = field(default_factory=list)
    uses: list[dict[str, Cell]] = field(default_factory=list)


class Archive(reader.SqlReader):
    """Archive; stores implement the access to one thread at a time.

    StorageError: unreachable; InputError: refused input.
    """

    @abstractmethod
    def _run_many(self, sql: str, values: Sequence[Mapping[str, Cell]]) -> None:
        """Execute a statement for each set of values."""

    @abstractmethod
    def _transaction(self) -> AbstractContextManager[None]:
        """Open a transaction, rolled back on errors, which become sentences."""

    @abstractmethod
    def _settle(self) -> None:
        """Run what is deferred to the end of the transaction."""

    def put(self, delivery: records.Delivery) -> Receipt:
        """Store a job, once for any number of deliveries."""
        return self.put_all([delivery])[0]

    def put_all(self, deliveries: Sequence[records.Delivery]) -> list[Receipt]:
        for delivery in deliveries:
            records.check_delivery(delivery)
            if hashlib.sha256(delivery.content).hexdigest() != delivery.record.job.sha256:
                raise InputError(
                    "archive.row",
                    "The archive cannot keep this job: its file is not the one that its rows are "
                    "about.",
                    "Send it again.",
                )
        with self._transaction():
            now = self._now()
            rows = _Rows()
            receipts = [self._put(delivery, now, rows) for delivery in deliveries]
            # Many in one go: each statement is a round trip to a server.
            self._run_many(reader.ADD_RESULT, rows.results)
            self._run_many(reader.ADD_USE, rows.uses)
            self._settle()
            for delivery, receipt in zip(deliveries, receipts, strict=True):
                if receipt.answer is Acknowledgement.STORED:
                    self._check_rows(delivery, receipt.job)
        for delivery in deliveries:
            self._check_kept(delivery)
        return receipts

    def _check_rows(self, delivery: records.Delivery, job: int) -> None:
        """Raise StorageError if the stored rows were altered, e.g. by a trigger of the server."""
        sent = delivery.record
        number: dict[str, Cell] = {"id": job}
        told = (
            ("job", reader.OF_JOB,
             [tuple(getattr(sent.job, field) for field in reader.JOB_FIELDS)]),
            ("results", reader.RESULTS_SHOWN,
             [tuple(getattr(row, f) for f in reader.RESULT_FIELDS[:9]) for row in sent.results]),
            ("uses", reader.USES_SHOWN,
             sorted((use.kind, use.identity, use.name) for use in sent.uses)),
        )  # fmt: skip
        for where, statement, expected in told:
            found = self._run(statement, number).rows
            # Views show the newest version only: they have no rows of an older one.
            if list(found) != expected and (found or where == "job" or self._is_newest(job)):
                raise faults.altered_rows(self.place, sent.job.job_uuid, where)

    def _is_newest(self, job: int) -> bool:
        return bool(self._run("SELECT 1 FROM archived_job WHERE job_id = :id", {"id": job}).rows)

    def _check_kept(self, delivery: records.Delivery) -> None:
        """Raise StorageError if an acknowledged job is missing."""
        number: dict[str, Cell] = {
            "outbox": delivery.sender.outbox, "sequence": delivery.sequence,
        }  # fmt: skip
        job = delivery.record.job
        if self.query(reader.KEPT.format(who=self._who), number).rows != ((job.sha256, True),):
            raise faults.not_kept(self.place, job.job_uuid)

    def _put(self, delivery: records.Delivery, now: datetime, rows: _Rows) -> Receipt:
        sender, job = delivery.sender, delivery.record.job
        number: dict[str, Cell] = {"outbox": sender.outbox, "sequence": delivery.sequence}
        off = (datetime.fromisoformat(records.utc_text(delivery.sent_utc)) - now).total_seconds()
        of_delivery = reader.OF_DELIVERY.format(who=self._who)
        found = self._table(self._run(of_delivery, number), (int, str)).rows
        if found:
            if found[0][1] != job.sha256:
                raise StorageError(
                    "archive.sequence",
                    f"Number {delivery.sequence} of outbox {sender.outbox[:8]} was delivered "
                    "before with another job: two computers share this outbox, e.g. by a copied "
                    "disk.",
                    "On the copied computer: ocmm archive new-outbox. What waits there is kept.",
                )
            return Receipt(Acknowledgement.KNOWN, reader.whole_of(found[0][0]), off)
        self._admit(sender)
        # A file that was altered without its head is a separate version: it must be visible.
        version: dict[str, Cell] = {
            "job_uuid": job.job_uuid, "steps": job.steps, "head": job.head,
            "sound": int(not job.fault), "station": job.station,
        }  # fmt: skip
        there = self._table(self._run(reader.OF_VERSION, version), (int,)).rows
        if there:
            row, answer = reader.whole_of(there[0][0]), Acknowledgement.KNOWN
        else:
            row, answer = self._add(delivery, rows), Acknowledgement.STORED
        self._run(
            reader.ADD_DELIVERY, {**number, "job": row, "sha256": job.sha256,
                            "sent_utc": delivery.sent_utc, "signature": delivery.signature},
        )  # fmt: skip
        return Receipt(answer, row, off)

    def _admit(self, sender: records.Sender) -> None:
        """Admit a sender; StorageError if another computer used its name first."""
        name: dict[str, Cell] = {"name": sender.station}
        claim = (
            "SELECT coalesce(nullif(s.machine, ''), (SELECT x.machine FROM sender x"
            " WHERE x.station = s.name AND x.machine <> '' ORDER BY x.since_utc LIMIT 1), ''),"
            " s.host, s.since_utc FROM station s WHERE s.name = :name"
        )
        found = self._run(claim, name).rows
        if not found:
            self._run(reader.ADD_STATION, {**name, "machine": sender.machine, "host": sender.host})
            found = self._run(claim, name).rows
        if len(found) != 1 or len(found[0]) != 3:
            raise faults.not_understood(self.place, f"station '{sender.station}' is not there")
        host, since = (records.shown_text(str(cell)) for cell in found[0][1:])
        if found[0][0] not in ("", sender.machine):
            raise StorageError(
                "archive.station",
                f"The archive knows another computer as station '{sender.station}' "
                f"({host or 'no name'}, since {since[:10]}). Jobs of both would be taken for one "
                "another's.",
                "Give this station a name of its own: ocmm settings set archive.station NAME. If "
                "this computer replaces that one, quality lets it: ocmm archive replace-computer.",
            )
        self._run(
            reader.ADD_SENDER,
            {
                "outbox": sender.outbox, "station": sender.station, "machine": sender.machine,
                "username": sender.user,
            },
        )  # fmt: skip
        if sender.key:
            own = {"station": sender.station, "key": sender.key, "proof": sender.proof}
            self._run(reader.ADD_STATION_KEY, own)

    def _add(self, delivery: records.Delivery, rows: _Rows) -> int:
        record = delivery.record
        job = record.job
        self._run(
            reader.ADD_FILE, {"sha256": job.sha256, "size": job.size, "content": delivery.content}
        )
        values: dict[str, Cell] = {field: getattr(job, field) for field in reader.JOB_FIELDS}
        values |= {"complete": int(job.complete), "simulated": int(job.simulated)}
        values["sound"] = int(not job.fault)
        number = reader.whole_of(self._added(reader.ADD_JOB, values, job.job_uuid))
        both: dict[str, Cell] = {"job": number, "created_utc": job.created_utc}
        rows.results += [
            {**both, "part": job.part, **{f: getattr(row, f) for f in reader.RESULT_FIELDS}}
            for row in record.results
        ]
        rows.uses += [
            {**both, "kind": use.kind, "identity": use.identity, "name": use.name}
            for use in record.uses
        ]
        return number

    def _added(self, sql: str, values: Mapping[str, Cell], what: str) -> Cell:
        """Return the number of an added row; StorageError if none was added."""
        rows = self._table(self._run(sql, values), (int,)).rows
        if not rows:
            raise faults.not_kept(self.place, what)
        return rows[0][0]

    def add_finding(
        self, kind: str, subject: str, document: str, who: str, utc: str,
        marks: Sequence[records.MarkRow] = (),
    ) -> int:  # fmt: skip
        """Store a document with its marks in one transaction; return its number."""
        for mark in marks:
            records.check_mark(mark)
        with self._transaction():
            fields: dict[str, Cell] = {
                "kind": kind, "subject": subject, "document": document, "who": who, "utc": utc,
            }  # fmt: skip
            number = reader.whole_of(self._added(reader.ADD_FINDING, fields, subject))
            self._run_many(
                reader.ADD_MARK,
                [
                    {field: getattr(mark, field) for field in reader.MARK_FIELDS}
                    | {"holds": int(mark.holds), "finding": number}
                    for mark in marks
                ],
            )
        return number

    def _filled(self, version: int) -> None:
        """Fill in columns of a new schema version that SQL cannot compute."""
        if version != SIGNATURES_SINCE:
            return
        for number, sha256 in self._run("SELECT id, sha256 FROM job WHERE signer <> ''").rows:
            rows = self._run("SELECT content FROM file WHERE sha256 = :sha256", {"sha256": sha256})
            # Unreadable files stay empty: verify names them.
            with contextlib.suppress(OcmmError, LookupError):
                key, signature = records.signature_of(cast("bytes", rows.rows[0][0]))
                self._run(
                    "UPDATE job SET key = :key, signature = :signature WHERE id = :id",
                    {"id": number, "key": key, "signature": signature},
                )

    def admit(self, login: str, station: str) -> None:
        """Authorise a login of the server to send as a station."""
        with self._transaction():
            self._run(reader.ADD_STATION_LOGIN, {"login": login, "station": station})

    def replace_computer(self, station: str, sender: records.Sender) -> None:
        """Replace the computer of a station."""
        with self._transaction():
            self._run(
                "UPDATE station SET machine = :machine, host = :host WHERE name = :name",
                {"machine": sender.machine, "host": sender.host, "name": station},
            )

    @abstractmethod
    def give_roles(self, statements: Sequence[str]) -> None:
        """Execute the statements that create roles; a store without users has none."""


def verifies(what: Signed, content: bytes, key: str, signature: str) -> bool:
    """Return whether a key signed this, trusted or not."""
    nobody = KeptKeys(Path("/nonexistent"))
    state = judge_signature(nobody, what, content, Signature(key, signature))
    return state.word is SealWord.UNKNOWN_KEY


def stations_by_key(archive: Archive) -> dict[str, set[str]]:
    """Return the stations that proved possession of a key, by key."""
    found: dict[str, set[str]] = {}
    rows = archive.query("SELECT station, key, proof FROM archive_station_key").rows
    for station, key, proof in rows:
        if verifies(Signed.STATION, records.station_claim(str(station)), str(key), str(proof)):
            found.setdefault(str(key), set()).add(str(station))
    return found
