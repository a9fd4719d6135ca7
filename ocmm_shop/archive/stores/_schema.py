"""Tables of an archive, and their migrations: forward only.

One text for both stores; words in braces are store-specific. Released migrations are never changed.
An archive of a later version is not opened, neither to write nor to read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_shop.archive.stores._views import JUDGED_VIEWS

APPLICATION_ID = 0x4F434D41  # "OCMA"
SIGNATURES_SINCE = 3
"""First version with the signature of a job's head."""
NEWER_CODE = "archive.newer"


@dataclass(frozen=True, slots=True)
class Dialect:
    """SQL words of a store."""

    id: str
    """Type of a column with automatic numbers."""
    text: str
    real: str
    whole: str
    blob: str
    """`text`, `real`, `whole`, `blob`: Types; texts are compared byte by byte."""
    who: str
    now: str
    """`who`, `now`: Defaults: login, and time by the clock of the store, UTC, ISO 8601."""
    hash_check: str
    """A condition on table ``file``; empty if the store cannot compute SHA-256."""


SQLITE = Dialect(
    id="INTEGER PRIMARY KEY",
    text="TEXT",
    real="REAL",
    whole="INTEGER",
    blob="BLOB",
    who="'local'",
    now="(strftime('%Y-%m-%dT%H:%M:%f+00:00', 'now'))",
    hash_check="",
)
POSTGRESQL = Dialect(
    id="bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY",
    text='text COLLATE "C"',
    real="double precision",
    whole="bigint",
    blob="bytea",
    who="SESSION_USER",
    now="to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS+00:00')",
    hash_check=", CHECK (sha256 = encode(sha256(content), 'hex'))",
)

_SENDER = """CREATE TABLE sender (
    outbox {text} PRIMARY KEY CHECK (length(outbox) = 36),
    station {text} NOT NULL REFERENCES station (name),
    machine {text} NOT NULL,
    username {text} NOT NULL,
    role {text} NOT NULL DEFAULT {who},
    since_utc {text} NOT NULL DEFAULT {now})"""
_JOB = """CREATE TABLE job (
    id {id},
    job_uuid {text} NOT NULL CHECK (length(job_uuid) = 36),
    steps {whole} NOT NULL CHECK (steps > 0),
    head {text} NOT NULL CHECK (length(head) = 64),
    sha256 {text} NOT NULL REFERENCES file (sha256),
    size {whole} NOT NULL,
    station {text} NOT NULL REFERENCES station (name),
    state {text} NOT NULL CHECK (state IN ('finished', 'paused', 'open')),
    part {text} NOT NULL, serial {text} NOT NULL, order_name {text} NOT NULL,
    batch {text} NOT NULL, operator {text} NOT NULL,
    plan {text} NOT NULL, plan_sha256 {text} NOT NULL, program {text} NOT NULL,
    created_utc {text} NOT NULL CHECK (length(created_utc) = 29),
    changed_utc {text} NOT NULL CHECK (length(changed_utc) = 29),
    rig {text} NOT NULL, calibration {text} NOT NULL,
    probe {text} NOT NULL, tip {text} NOT NULL,
    part_c {real}, probe_c {real},
    verdict {text} NOT NULL CHECK (verdict IN ('PART CONFORMS', 'PART DOES NOT CONFORM',
        'NOT PROVEN', 'NOT COMPLETE', 'NO TOLERANCE')),
    complete {whole} NOT NULL CHECK (complete IN (0, 1)),
    simulated {whole} NOT NULL CHECK (simulated IN (0, 1)),
    points {whole} NOT NULL CHECK (points >= 0),
    seal {text} NOT NULL, signer {text} NOT NULL, fault {text} NOT NULL,
    sound {whole} NOT NULL CHECK (sound IN (0, 1) AND (sound = 1) = (fault = '')),
    received_utc {text} NOT NULL DEFAULT {now},
    role {text} NOT NULL DEFAULT {who},
    UNIQUE (job_uuid, steps, head, sound))"""
_DELIVERY = """CREATE TABLE delivery (
    outbox {text} NOT NULL REFERENCES sender (outbox),
    sequence {whole} NOT NULL CHECK (sequence > 0),
    job {whole} NOT NULL REFERENCES job (id),
    sha256 {text} NOT NULL,
    sent_utc {text} NOT NULL,
    received_utc {text} NOT NULL DEFAULT {now},
    role {text} NOT NULL DEFAULT {who},
    PRIMARY KEY (outbox, sequence))"""
_FIRST = (
    """CREATE TABLE migration (
        version {whole} PRIMARY KEY,
        applied_utc {text} NOT NULL DEFAULT {now},
        program {text} NOT NULL)""",
    """CREATE TABLE station (
        name {text} PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 300),
        machine {text} NOT NULL,
        host {text} NOT NULL,
        since_utc {text} NOT NULL DEFAULT {now})""",
    _SENDER,
    """CREATE TABLE file (
        sha256 {text} PRIMARY KEY CHECK (length(sha256) = 64),
        size {whole} NOT NULL CHECK (size = length(content)),
        content {blob} NOT NULL{hash_check})""",
    _JOB,
    "CREATE INDEX job_by_day ON job (changed_utc)",
    "CREATE INDEX job_by_station ON job (station, changed_utc)",
    """CREATE TABLE result (
        job {whole} NOT NULL REFERENCES job (id),
        position {whole} NOT NULL CHECK (position >= 0),
        part {text} NOT NULL,
        created_utc {text} NOT NULL CHECK (length(created_utc) = 29),
        characteristic {text} NOT NULL, kind {text} NOT NULL,
        unit {text} NOT NULL CHECK (unit IN ('mm', 'deg')),
        nominal {real} NOT NULL, low {real}, high {real},
        value {real}, uncertainty {real} CHECK (uncertainty >= 0),
        verdict {text} NOT NULL CHECK (verdict IN ('CONFORM', 'NOT CONFORM', 'NOT PROVEN',
            'NOT MEASURED', 'PROVISIONAL')),
        why_not {text} NOT NULL,
        PRIMARY KEY (job, position),
        CHECK ((value IS NULL) = (uncertainty IS NULL)),
        CHECK (why_not <> '' OR value IS NOT NULL))""",
    "CREATE INDEX result_by_characteristic ON result (part, characteristic, created_utc)",
    """CREATE TABLE used (
        job {whole} NOT NULL REFERENCES job (id),
        kind {text} NOT NULL CHECK (kind IN
            ('calibration', 'tip', 'probe', 'artefact', 'rig', 'plan', 'reference')),
        identity {text} NOT NULL, name {text} NOT NULL,
        created_utc {text} NOT NULL,
        PRIMARY KEY (job, kind, identity))""",
    "CREATE INDEX used_by_identity ON used (kind, identity, created_utc)",
    "CREATE INDEX used_by_name ON used (kind, name, created_utc)",
    _DELIVERY,
    "CREATE INDEX delivery_by_job ON delivery (job)",
    """CREATE TABLE finding (
        id {id},
        kind {text} NOT NULL, subject {text} NOT NULL, document {text} NOT NULL,
        who {text} NOT NULL, utc {text} NOT NULL,
        role {text} NOT NULL DEFAULT {who},
        received_utc {text} NOT NULL DEFAULT {now})""",
    """CREATE TABLE mark (
        id {id},
        job_uuid {text} NOT NULL,
        kind {text} NOT NULL CHECK (kind IN ('altered', 'recall', 'quality')),
        holds {whole} NOT NULL CHECK (holds IN (0, 1)),
        why {text} NOT NULL, who {text} NOT NULL, utc {text} NOT NULL,
        finding {whole} NOT NULL DEFAULT 0,
        role {text} NOT NULL DEFAULT {who},
        received_utc {text} NOT NULL DEFAULT {now})""",
    "CREATE INDEX mark_by_job ON mark (job_uuid, kind, id)",
)

_VIEWS_BEFORE = tuple(
    f"DROP VIEW IF EXISTS {name}"
    for name in (
        "archived_use", "archive_today", "archive_month", "archived_result",
        "archived_line_result", "archived_job", "archived_line", "archive_station",
        "archive_station_key", "archive_mark", "archive_characteristic",
    )
)  # fmt: skip
"""The last step makes all views; earlier steps no longer do."""
_SECOND = ("CREATE INDEX job_by_arrival ON job (station, received_utc)",)

# The third step binds rows to login, station, key and outbox; readers judge signers. Numbers of an
# outbox belong to the login that uses it, versions of a job to their station.
_LOGINS = (
    """CREATE TABLE station_login (
        login {text} NOT NULL CHECK (length(login) BETWEEN 1 AND 300),
        station {text} NOT NULL CHECK (length(station) BETWEEN 1 AND 300),
        role {text} NOT NULL DEFAULT {who},
        since_utc {text} NOT NULL DEFAULT {now},
        PRIMARY KEY (login, station))""",
    """CREATE TABLE station_key (
        station {text} NOT NULL REFERENCES station (name),
        key {text} NOT NULL CHECK (length(key) BETWEEN 1 AND 300),
        proof {text} NOT NULL CHECK (length(proof) BETWEEN 1 AND 300),
        role {text} NOT NULL DEFAULT {who},
        since_utc {text} NOT NULL DEFAULT {now},
        PRIMARY KEY (station, key))""",
    # Of an older archive: the only login that sent under a name is that station.
    """INSERT INTO station_login (login, station)
        SELECT min(role), station FROM sender GROUP BY station HAVING min(role) = max(role)""",
    "UPDATE job SET seal = 'SIGNED' WHERE seal IN ('SEALED', 'UNKNOWN KEY')",
    "CREATE INDEX job_by_part ON job (part, created_utc)",
)
_JOB_BEFORE = (
    "id, job_uuid, steps, head, sha256, size, station, state, part, serial, order_name, batch,"
    " operator, plan, plan_sha256, program, created_utc, changed_utc, rig, calibration, probe, tip,"
    " part_c, probe_c, verdict, complete, simulated, points, seal, signer, fault, sound,"
    " received_utc, role"
)
_UNIQUE = "UNIQUE (job_uuid, station, steps, head, sound)"
_SIGNED = "key {text} NOT NULL DEFAULT '', signature {text} NOT NULL DEFAULT ''"
_THIRD_SQLITE = (
    # Constraints cannot be dropped, so the table is rebuilt. All of its rows are of one login.
    _JOB.replace("job (", "job_new (", 1).replace(
        "UNIQUE (job_uuid, steps, head, sound)", f"{_SIGNED}, {_UNIQUE}"
    ),
    f"INSERT INTO job_new ({_JOB_BEFORE}) SELECT {_JOB_BEFORE} FROM job",  # noqa: S608
    "DROP TABLE job",
    "ALTER TABLE job_new RENAME TO job",
    "ALTER TABLE delivery ADD COLUMN signature {text} NOT NULL DEFAULT ''",
    "CREATE INDEX job_by_day ON job (changed_utc)",
    "CREATE INDEX job_by_station ON job (station, changed_utc)",
    "CREATE INDEX job_by_arrival ON job (station, received_utc)",
)
_THIRD_POSTGRESQL = (
    f"ALTER TABLE job DROP CONSTRAINT job_job_uuid_steps_head_sound_key, ADD {_UNIQUE},"
    f" ADD COLUMN {_SIGNED.replace(', ', ', ADD COLUMN ')}",
    "ALTER TABLE delivery DROP CONSTRAINT delivery_outbox_fkey,"
    " DROP CONSTRAINT delivery_pkey, ADD COLUMN signature {text} NOT NULL DEFAULT ''",
    "ALTER TABLE sender DROP CONSTRAINT sender_pkey, ADD PRIMARY KEY (outbox, role)",
    # A login that used the outbox of another one.
    """INSERT INTO sender (outbox, station, machine, username, role)
        SELECT DISTINCT d.outbox, s.station, s.machine, s.username, d.role
        FROM delivery d JOIN sender s ON s.outbox = d.outbox WHERE d.role <> s.role""",
    "ALTER TABLE delivery ADD PRIMARY KEY (outbox, role, sequence),"
    " ADD FOREIGN KEY (outbox, role) REFERENCES sender (outbox, role)",
)


def _third(dialect: Dialect) -> tuple[str, ...]:
    own = _THIRD_SQLITE if dialect is SQLITE else _THIRD_POSTGRESQL
    return (*_VIEWS_BEFORE, *own, *_LOGINS)


_FOURTH = (
    *_VIEWS_BEFORE,
    "ALTER TABLE job ADD COLUMN requirements {text} NOT NULL DEFAULT ''",
    *JUDGED_VIEWS,
)


MIGRATIONS: tuple[Callable[[Dialect], tuple[str, ...]], ...] = (
    lambda _: _FIRST,
    lambda _: _SECOND,
    _third,
    lambda _: _FOURTH,
)
"""Statements of each step; the version of an archive is the number of its steps."""

VERSION = len(MIGRATIONS)


def statements(step: int, dialect: Dialect) -> tuple[str, ...]:
    """Return the statements that bring an archive from ``step`` to the next version."""
    words = {name: getattr(dialect, name) for name in Dialect.__slots__}
    return tuple(text for one in MIGRATIONS[step](dialect) if (text := one.format(**words)))
