"""What both stores answer alike; nothing here can change an archive."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Self

from ocmm_core.archive.records import JobRecord, JobRow, MarkRow, ResultRow, UseRow
from ocmm_core.archive.stores._faults import damaged_file
from ocmm_core.archive.stores._interface import Cell, Finding, Table
from ocmm_core.archive.stores._statements import JOB_FIELDS, OF_JOB, RESULT_FIELDS
from ocmm_core.errors import StorageError


class SqlReader(ABC):
    """Read an archive in SQL.

    Attributes
    ----------
    place
        What people call it; without a password.
    """

    place: str

    @abstractmethod
    def _run(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Carry out a statement that names values as ``:name``; raises what the store raises."""

    @abstractmethod
    def _reading(self) -> AbstractContextManager[None]:
        """Open a transaction in which nothing can be written."""

    @abstractmethod
    def close(self) -> None:
        """Let go; may be called twice."""

    def heads(self, job_uuid: str) -> dict[int, str]:
        """Return the head of each version of a job: see `Archive`."""
        table = self.ask(
            "SELECT steps, head FROM job WHERE job_uuid = :job_uuid AND sound = 1 ORDER BY id DESC",
            {"job_uuid": job_uuid},
        )
        return {whole_of(steps): str(head) for steps, head in table.rows}

    def last_sequence(self, outbox: str) -> int:
        """Return the highest number of an outbox that arrived: see `Archive`."""
        table = self.ask(
            "SELECT coalesce(max(sequence), 0) FROM delivery WHERE outbox = :outbox",
            {"outbox": outbox},
        )
        return whole_of(table.rows[0][0])

    def arrived(self, outbox: str, sequences: Sequence[int]) -> set[int]:
        """Return which numbers of an outbox arrived: see `Archive`."""
        if not sequences:
            return set()
        table = self.ask(
            "SELECT sequence FROM delivery WHERE outbox = :outbox"
            " AND sequence BETWEEN :least AND :most",
            {"outbox": outbox, "least": min(sequences), "most": max(sequences)},
        )
        return {whole_of(row[0]) for row in table.rows} & set(sequences)

    def content(self, sha256: str) -> bytes:
        """Return a job file as it was stored: see `Archive`."""
        rows = self.ask("SELECT content FROM file WHERE sha256 = :sha256", {"sha256": sha256}).rows
        if not rows:
            raise StorageError(
                "archive.no_file",
                f"{self.place}: there is no job file {sha256[:12]}.",
                "Check its SHA-256; ocmm archive verify names what is missing.",
            )
        content = rows[0][0]
        if not isinstance(content, bytes) or hashlib.sha256(content).hexdigest() != sha256:
            raise damaged_file(sha256)
        return content

    def record(self, job: int) -> JobRecord:
        """Return the rows of a job by its number: see `Archive`."""
        found = self.ask(OF_JOB, {"id": job}).rows
        if not found:
            raise StorageError(
                "archive.no_job", f"{self.place}: there is no job {job}.", "Ask for another one."
            )
        fields = dict(zip(JOB_FIELDS, found[0], strict=True))
        fields |= {name: bool(fields[name]) for name in ("complete", "simulated")}
        results = self.ask(
            "SELECT position, characteristic, kind, unit, nominal, low, high, value, uncertainty,"
            " verdict, why_not FROM result WHERE job = :id ORDER BY position",
            {"id": job},
        )
        uses = self.ask(
            "SELECT kind, identity, name FROM used WHERE job = :id ORDER BY kind, identity",
            {"id": job},
        )
        return JobRecord(
            job=JobRow(**fields),  # type: ignore[arg-type] # the columns are its fields
            results=tuple(
                ResultRow(**dict(zip(RESULT_FIELDS, row, strict=True)))  # type: ignore[arg-type]
                for row in results.rows
            ),
            uses=tuple(
                UseRow(**dict(zip(("kind", "identity", "name"), row, strict=True)))  # type: ignore[arg-type]
                for row in uses.rows
            ),
        )

    def ask(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        """Return the answer of a question: see `Archive`."""
        with self._reading():
            return self._run(sql, values)

    def findings(self, after: int = 0) -> list[Finding]:
        """Return documents with a higher number: see `Archive`."""
        table = self.ask(
            "SELECT id, kind, subject, document, who, utc FROM finding WHERE id > :after"
            " ORDER BY id",
            {"after": after},
        )
        return [Finding(whole_of(row[0]), *(str(cell) for cell in row[1:])) for row in table.rows]

    def marks(self, after: int = 0) -> list[tuple[int, MarkRow]]:
        """Return marks with a higher number: see `Archive`."""
        table = self.ask(
            "SELECT id, job_uuid, kind, holds, why, who, utc, finding FROM mark WHERE id > :after"
            " ORDER BY id",
            {"after": after},
        )
        return [
            (
                whole_of(number),
                MarkRow(
                    job_uuid=str(job), kind=str(kind), holds=bool(holds), why=str(why),
                    who=str(who), utc=str(utc), finding=whole_of(finding),
                ),
            )
            for number, job, kind, holds, why, who, utc, finding in table.rows
        ]  # fmt: skip

    def __enter__(self) -> Self:
        """Return the archive."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let go."""
        self.close()


def whole_of(cell: Cell) -> int:
    """Return a number that was counted; StorageError where it is none."""
    if not isinstance(cell, int):
        raise StorageError(
            "archive.foreign", "A number in the archive is none.", "Restore it from a backup."
        )
    return cell
