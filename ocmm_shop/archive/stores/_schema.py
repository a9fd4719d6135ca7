"""Tables and views of an archive, and their migrations: forward only.

One text for both stores; words in braces are store-specific. Released migrations are never changed.
An archive of a later version is not opened, neither to write nor to read.

Views are for SQL users; `docs/quality/archive.md` explains their columns. They contain facts only;
readers decide with their own keys which ones they trust. A *line* is all that one station sent of
one job under one key, represented by the newest sound version. `archived_job` has one line of each
job. A suspect job is NOT PROVEN.
"""

from __future__ import annotations

import contextlib
import functools
import sqlite3
from collections.abc import Callable, Mapping
from dataclasses import dataclass

# A mark holds until a later one of its kind lifts it.
_HELD = """EXISTS (SELECT 1 FROM mark m WHERE m.job_uuid = j.job_uuid AND m.holds = 1
        AND NOT EXISTS (SELECT 1 FROM mark l WHERE l.job_uuid = m.job_uuid
            AND l.kind = m.kind AND l.id > m.id))"""
_OWN = "(SELECT count(*) FROM station_key k WHERE k.station = {0}.station AND k.key = {0}.key)"
_FIRST_ID = """(SELECT min(f.id) FROM job f WHERE f.job_uuid = j.job_uuid
        AND f.station = j.station AND f.signer = j.signer AND f.sound = j.sound)"""
_OTHERS = """(SELECT count(*) FROM job o WHERE o.job_uuid = j.job_uuid AND o.id <> j.id
        AND (o.station <> j.station OR o.signer <> j.signer OR o.sound = 0))"""
_OF_JOB = """job_id, job_uuid, steps, sha256, size, station, state, part, serial, order_name, batch,
        operator, plan, plan_sha256, program, created_utc, changed_utc, received_utc, rig,
        calibration, probe, tip, part_c, probe_c, verdict, complete, simulated, points, seal,
        signer, fault, held, head, job_key, signature, others, first_id, leads,
        requirements"""
_DISTINCT = "CASE WHEN serial = '' THEN job_uuid ELSE serial END"
"""Parts without a serial number cannot be distinguished: each job is one."""
_LIMITS = "part, characteristic, simulated, unit, low, high"
# Steps along the index: a DISTINCT would read all values.
_STEPS = """WITH RECURSIVE p (part) AS (
        SELECT min(r.part) FROM result r
        UNION ALL SELECT (SELECT min(r.part) FROM result r WHERE r.part > p.part)
        FROM p WHERE p.part IS NOT NULL),
    c (part, characteristic) AS (
        SELECT p.part, (SELECT min(r.characteristic) FROM result r WHERE r.part = p.part)
        FROM p WHERE p.part IS NOT NULL
        UNION ALL SELECT c.part, (SELECT min(r.characteristic) FROM result r
            WHERE r.part = c.part AND r.characteristic > c.characteristic)
        FROM c WHERE c.characteristic IS NOT NULL)"""

JUDGED_VIEWS = (
    f"""CREATE VIEW archived_line AS
    SELECT j.id AS job_id, j.job_uuid, j.steps, j.sha256, j.size, j.station, j.state, j.part,
        j.serial, j.order_name, j.batch, j.operator, j.plan, j.plan_sha256, j.program,
        j.created_utc, j.changed_utc, j.received_utc, j.rig, j.calibration, j.probe, j.tip,
        j.part_c, j.probe_c, CASE WHEN j.fault <> '' OR {_HELD} THEN 'NOT PROVEN'
            ELSE j.verdict END AS verdict, j.complete, j.simulated, j.points, j.seal, j.signer,
        j.fault,
        j.requirements, CASE WHEN {_HELD} THEN 1 ELSE 0 END AS held, j.head, j.key AS job_key,
        j.signature, {_OTHERS} AS others, {_FIRST_ID} AS first_id,
        CASE WHEN EXISTS (SELECT 1 FROM job m WHERE m.job_uuid = j.job_uuid
            AND (m.station <> j.station OR m.signer <> j.signer)
            AND (m.sound > j.sound OR (m.sound = j.sound AND (
                {_OWN.format("m")} > {_OWN.format("j")} OR ({_OWN.format("m")} = {_OWN.format("j")}
                    AND m.id < {_FIRST_ID})))))
            THEN 0 ELSE 1 END AS leads
    FROM job j
    WHERE NOT EXISTS (SELECT 1 FROM job n WHERE n.job_uuid = j.job_uuid
        AND n.station = j.station AND n.signer = j.signer
        AND (n.sound > j.sound OR (n.sound = j.sound
            AND (n.steps > j.steps OR (n.steps = j.steps AND n.id < j.id)))))""",  # noqa: S608
    f"CREATE VIEW archived_job AS SELECT {_OF_JOB} FROM archived_line WHERE leads = 1",  # noqa: S608
    """CREATE VIEW archived_line_result AS
    SELECT a.job_id, a.job_uuid, a.station, a.state, a.serial, a.batch, a.order_name, a.operator,
        a.simulated, a.changed_utc, a.calibration, a.tip, a.part_c,
        a.part, a.created_utc, r.position, r.characteristic, r.kind, r.unit, r.nominal, r.low,
        r.high, r.value, r.uncertainty,
        CASE WHEN a.fault <> '' OR a.held = 1 THEN 'NOT PROVEN' ELSE r.verdict END AS verdict,
        CASE WHEN r.why_not = '' AND a.fault = '' AND a.held = 0 THEN 1 ELSE 0 END AS counted,
        CASE WHEN a.fault <> '' THEN a.fault WHEN a.held = 1 THEN 'Held back: see the marks.'
            ELSE r.why_not END AS why_not,
        a.fault, a.held, a.steps, a.head, a.sha256, a.job_key, a.signature, a.signer, a.others,
        a.leads
    FROM archived_line a JOIN result r ON r.job = a.job_id""",
    "CREATE VIEW archived_result AS SELECT * FROM archived_line_result WHERE leads = 1",
    """CREATE VIEW archived_use AS
    SELECT u.kind AS used_kind, u.identity, u.name, a.*, u.created_utc AS used_utc
    FROM used u JOIN archived_job a ON a.job_id = u.job""",
    """CREATE VIEW archive_today AS
    SELECT substr(a.changed_utc, 1, 10) AS day, a.* FROM archived_job a""",
    f"""CREATE VIEW archive_month AS
    SELECT part, characteristic, month, simulated, unit, count(*) AS parts, avg(value) AS mean,
        min(value) AS least, max(value) AS most, min(low) AS low, min(high) AS high,
        avg(step) / 1.1283791670955126 AS sigma_within, avg(uncertainty) AS mean_u
    FROM (SELECT {_LIMITS}, value, uncertainty, month,
            abs(value - lag(value) OVER (PARTITION BY {_LIMITS}, month
                ORDER BY created_utc, job_id)) AS step
        FROM (SELECT {_LIMITS}, value, uncertainty, created_utc, job_id,
                substr(created_utc, 1, 7) AS month,
                row_number() OVER (PARTITION BY {_LIMITS}, {_DISTINCT}
                    ORDER BY created_utc DESC, job_id DESC) AS place
            FROM archived_result WHERE counted = 1 AND state = 'finished') o
        WHERE place = 1) v
    GROUP BY {_LIMITS}, month""",  # noqa: S608
    """CREATE VIEW archive_station AS
    SELECT s.name AS station, s.host, s.since_utc,
        (SELECT max(j.received_utc) FROM job j WHERE j.station = s.name) AS last_received_utc
    FROM station s""",
    """CREATE VIEW archive_station_key AS
    SELECT k.station, k.key, k.proof, k.since_utc FROM station_key k""",
    """CREATE VIEW archive_mark AS
    SELECT m.id, m.job_uuid, m.kind, m.holds, m.why, m.who, m.utc, m.finding, m.role,
        m.received_utc
    FROM mark m""",
    f"""CREATE VIEW archive_characteristic AS {_STEPS}
    SELECT part, characteristic FROM c WHERE characteristic IS NOT NULL""",  # noqa: S608
)

VIEW_NAMES = tuple(statement.split()[2] for statement in JUDGED_VIEWS)


APPLICATION_ID = 0x4F434D41  # "OCMA"
SIGNATURES_SINCE = 3
"""First version with the signature of a job's head."""


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

_VIEWS_BEFORE = tuple(f"DROP VIEW IF EXISTS {name}" for name in reversed(VIEW_NAMES))
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


_TIMES = ("created_utc", "changed_utc", "received_utc", "sent_utc", "used_utc")


@functools.cache
def column_kinds() -> Mapping[str, str]:
    """Return the type of each column of tables and views: TEXT, INTEGER, REAL, BLOB or TIME.

    A name has the same type everywhere. Computed columns are missing.
    """
    return {
        name: "TIME" if name in _TIMES else kind
        for _, name, kind, _ in (*columns_of("table"), *columns_of("view"))
        if kind in ("TEXT", "INTEGER", "REAL", "BLOB")
    }


@functools.cache
def columns_of(what: str) -> tuple[tuple[str, str, str, bool], ...]:
    """Return the columns of each table or each view: its name, theirs, type, may be NULL."""
    with contextlib.closing(made_in_memory()) as made:
        return tuple(
            (table, name, kind, not (filled or key))
            for (table,) in made.execute("SELECT name FROM sqlite_master WHERE type = ?", (what,))
            for _, name, kind, filled, _, key in made.execute(f"PRAGMA table_info({table})")
        )


def made_in_memory() -> sqlite3.Connection:
    """Return an empty archive of this version in memory."""
    made = sqlite3.connect(":memory:")
    for step in range(VERSION):
        for statement in statements(step, SQLITE):
            made.execute(statement)
    return made


def statements(step: int, dialect: Dialect) -> tuple[str, ...]:
    """Return the statements that bring an archive from ``step`` to the next version."""
    words = {name: getattr(dialect, name) for name in Dialect.__slots__}
    return tuple(text for one in MIGRATIONS[step](dialect) if (text := one.format(**words)))
