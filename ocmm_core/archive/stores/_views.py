"""Views for people who ask by SQL; `docs/archive.md` explains their columns.

They are the same on both stores. Only the newest version of a job is in them; what counts in
statistics has ``counted = 1``, and ``why_not`` says why a value does not. What is in doubt is NOT
PROVEN, whatever was decided before: nobody who asks by SQL sees it greener.
"""

from __future__ import annotations

# A mark holds until a later one of its kind lifts it.
_HELD = """EXISTS (SELECT 1 FROM mark m WHERE m.job_uuid = j.job_uuid AND m.holds = 1
        AND NOT EXISTS (SELECT 1 FROM mark l WHERE l.job_uuid = m.job_uuid
            AND l.kind = m.kind AND l.id > m.id))"""

VIEWS = (
    f"""CREATE VIEW archived_job AS
    SELECT j.id AS job_id, j.job_uuid, j.steps, j.sha256, j.size, j.station, j.state, j.part,
        j.serial, j.order_name, j.batch, j.operator, j.plan, j.plan_sha256, j.program,
        j.created_utc, j.changed_utc, j.received_utc, j.rig, j.calibration, j.probe, j.tip,
        j.part_c, j.probe_c, CASE WHEN j.fault <> '' OR {_HELD} THEN 'NOT PROVEN'
            ELSE j.verdict END AS verdict, j.complete, j.simulated, j.points, j.seal, j.signer,
        j.fault,
        CASE WHEN {_HELD} THEN 1 ELSE 0 END AS held
    FROM job j
    WHERE NOT EXISTS (SELECT 1 FROM job n WHERE n.job_uuid = j.job_uuid
        AND (n.steps > j.steps OR (n.steps = j.steps AND n.id > j.id)))""",  # noqa: S608 - our own words
    """CREATE VIEW archived_result AS
    SELECT a.job_id, a.job_uuid, a.station, a.state, a.serial, a.batch, a.order_name, a.operator,
        a.simulated, a.changed_utc, a.calibration, a.tip, a.part_c,
        r.part, r.created_utc, r.position, r.characteristic, r.kind, r.unit, r.nominal, r.low,
        r.high, r.value, r.uncertainty,
        CASE WHEN a.fault <> '' OR a.held = 1 THEN 'NOT PROVEN' ELSE r.verdict END AS verdict,
        CASE WHEN r.why_not = '' AND a.fault = '' AND a.held = 0 THEN 1 ELSE 0 END AS counted,
        CASE WHEN a.fault <> '' THEN a.fault WHEN a.held = 1 THEN 'Held back: see the marks.'
            ELSE r.why_not END AS why_not
    FROM result r JOIN archived_job a ON a.job_id = r.job""",
    """CREATE VIEW archived_use AS
    SELECT u.kind AS used_kind, u.identity, u.name, a.*
    FROM used u JOIN archived_job a ON a.job_id = u.job""",
    """CREATE VIEW archive_today AS
    SELECT substr(a.changed_utc, 1, 10) AS day, a.* FROM archived_job a""",
    """CREATE VIEW archive_month AS
    SELECT part, characteristic, month, simulated, unit, count(*) AS parts, avg(value) AS mean,
        min(value) AS least, max(value) AS most, min(low) AS low, min(high) AS high,
        avg(step) / 1.1283791670955126 AS sigma_within, avg(uncertainty) AS mean_u
    FROM (SELECT part, characteristic, simulated, unit, low, high, value, uncertainty,
            substr(created_utc, 1, 7) AS month,
            abs(value - lag(value) OVER (PARTITION BY part, characteristic, simulated, unit, low,
                high, substr(created_utc, 1, 7) ORDER BY created_utc, job_id)) AS step
        FROM archived_result WHERE counted = 1) v
    GROUP BY part, characteristic, month, simulated, unit, low, high""",
    """CREATE VIEW archive_station AS
    SELECT s.name AS station, s.host, s.since_utc,
        (SELECT max(j.received_utc) FROM job j WHERE j.station = s.name) AS last_received_utc
    FROM station s""",
    """CREATE VIEW archive_mark AS
    SELECT m.id, m.job_uuid, m.kind, m.holds, m.why, m.who, m.utc, m.finding, m.role,
        m.received_utc
    FROM mark m""",
)

_USE = """{create_view} VIEW archived_use AS
    SELECT u.kind AS used_kind, u.identity, u.name, a.*, u.created_utc AS used_utc
    FROM used u JOIN archived_job a ON a.job_id = u.job"""

_CHARACTERISTIC = """{create_view} VIEW archive_characteristic AS
    WITH RECURSIVE p (part) AS (
        SELECT min(r.part) FROM result r
        UNION ALL SELECT (SELECT min(r.part) FROM result r WHERE r.part > p.part)
        FROM p WHERE p.part IS NOT NULL),
    c (part, characteristic) AS (
        SELECT p.part, (SELECT min(r.characteristic) FROM result r WHERE r.part = p.part)
        FROM p WHERE p.part IS NOT NULL
        UNION ALL SELECT c.part, (SELECT min(r.characteristic) FROM result r
            WHERE r.part = c.part AND r.characteristic > c.characteristic)
        FROM c WHERE c.characteristic IS NOT NULL)
    SELECT part, characteristic FROM c WHERE characteristic IS NOT NULL"""
# From one to the next along the index: a DISTINCT would read every value there is.

GROWING = (_USE, _CHARACTERISTIC)
"""Views by which questions do not take longer, however many jobs there are."""

VIEW_NAMES = (
    "archived_job", "archived_result", "archived_use", "archive_today", "archive_month",
    "archive_station", "archive_mark", "archive_characteristic",
)  # fmt: skip
