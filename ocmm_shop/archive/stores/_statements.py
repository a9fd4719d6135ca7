"""Statements that add and find rows, the same for both stores."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_shop.archive.records import JobRow, MarkRow, ResultRow, UseRow

JOB_FIELDS = JobRow.__struct_fields__
RESULT_FIELDS = ResultRow.__struct_fields__
USE_FIELDS = UseRow.__struct_fields__


def _insert(table: str, fields: Sequence[str], more: str = "") -> str:
    # Names are those of our own classes, never from a message.
    named = ", ".join(f":{field}" for field in fields)
    return f"INSERT INTO {table} ({', '.join(fields)}) VALUES ({named}) {more}".strip()  # noqa: S608


ADD_JOB = _insert("job", (*JOB_FIELDS, "sound"), "RETURNING id")
ADD_RESULT = _insert("result", ("job", "part", "created_utc", *RESULT_FIELDS))
ADD_USE = _insert("used", ("job", "kind", "identity", "name", "created_utc"))
ADD_FILE = _insert("file", ("sha256", "size", "content"), "ON CONFLICT DO NOTHING")
ADD_DELIVERY = _insert("delivery", ("outbox", "sequence", "job", "sha256", "sent_utc", "signature"))
ADD_STATION = _insert("station", ("name", "machine", "host"), "ON CONFLICT DO NOTHING")
ADD_SENDER = _insert(
    "sender", ("outbox", "station", "machine", "username"), "ON CONFLICT DO NOTHING"
)
ADD_STATION_KEY = _insert("station_key", ("station", "key", "proof"), "ON CONFLICT DO NOTHING")
ADD_STATION_LOGIN = _insert("station_login", ("login", "station"), "ON CONFLICT DO NOTHING")
MARK_FIELDS = MarkRow.__struct_fields__
ADD_MARK = _insert("mark", MARK_FIELDS)
ADD_FINDING = _insert("finding", ("kind", "subject", "document", "who", "utc"), "RETURNING id")
OF_DELIVERY = (
    "SELECT job, sha256 FROM delivery WHERE outbox = :outbox AND role = {who}"
    " AND sequence = :sequence"
)
"""Numbers of an outbox are per login: another one cannot use them up."""
OF_VERSION = (
    "SELECT id FROM job WHERE job_uuid = :job_uuid AND steps = :steps AND head = :head"
    " AND sound = :sound AND station = :station"
)
KEPT = (
    "SELECT d.sha256, f.sha256 = j.sha256 FROM delivery d JOIN job j ON j.id = d.job"
    " JOIN file f ON f.sha256 = j.sha256 WHERE d.outbox = :outbox AND d.role = {who}"
    " AND d.sequence = :sequence"
)
RESULTS_SHOWN = (
    "SELECT position, characteristic, kind, unit, nominal, low, high, value, uncertainty"
    " FROM archived_result WHERE job_id = :id ORDER BY position"
)
USES_SHOWN = (
    "SELECT used_kind, identity, name FROM archived_use WHERE job_id = :id"
    " ORDER BY used_kind, identity"
)
"""From the views, because a station may read no more."""
_COLUMNS = ", ".join(JOB_FIELDS)
OF_JOB = f"SELECT {_COLUMNS} FROM job WHERE id = :id"  # noqa: S608 - names of our own class
