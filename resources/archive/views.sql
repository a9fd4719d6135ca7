-- For SQL users; docs/quality/archive.md explains their columns. Facts only: readers decide with
-- their own keys which ones they trust. A line is all that one station sent of one job under one
-- key, represented by the newest sound version. archived_job has one line of each job.
-- A suspect job is NOT PROVEN. A part without a serial number cannot be distinguished: each job
-- is one. Characteristics are found by steps along the index: a DISTINCT would read all values.
CREATE VIEW archived_line AS
    SELECT j.id AS job_id, j.job_uuid, j.steps, j.sha256, j.size, j.station, j.state, j.part,
        j.serial, j.order_name, j.batch, j.operator, j.plan, j.plan_sha256, j.program,
        j.created_utc, j.changed_utc, j.received_utc, j.rig, j.calibration, j.probe, j.tip,
        j.part_c, j.probe_c, CASE WHEN j.fault <> '' OR {held} THEN 'NOT PROVEN'
            ELSE j.verdict END AS verdict, j.complete, j.simulated, j.points, j.seal, j.signer,
        j.fault,
        j.requirements, CASE WHEN {held} THEN 1 ELSE 0 END AS held, j.head, j.key AS job_key,
        j.signature, {others} AS others, {first_id} AS first_id,
        CASE WHEN EXISTS (SELECT 1 FROM job m WHERE m.job_uuid = j.job_uuid
            AND (m.station <> j.station OR m.signer <> j.signer)
            AND (m.sound > j.sound OR (m.sound = j.sound AND (
                {own_m} > {own_j} OR ({own_m} = {own_j}
                    AND m.id < {first_id})))))
            THEN 0 ELSE 1 END AS leads
    FROM job j
    WHERE NOT EXISTS (SELECT 1 FROM job n WHERE n.job_uuid = j.job_uuid
        AND n.station = j.station AND n.signer = j.signer
        AND (n.sound > j.sound OR (n.sound = j.sound
            AND (n.steps > j.steps OR (n.steps = j.steps AND n.id < j.id)))));
CREATE VIEW archived_job AS SELECT job_id, job_uuid, steps, sha256, size, station, state, part, serial, order_name, batch,
        operator, plan, plan_sha256, program, created_utc, changed_utc, received_utc, rig,
        calibration, probe, tip, part_c, probe_c, verdict, complete, simulated, points, seal,
        signer, fault, held, head, job_key, signature, others, first_id, leads,
        requirements FROM archived_line WHERE leads = 1;
CREATE VIEW archived_line_result AS
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
    FROM archived_line a JOIN result r ON r.job = a.job_id;
CREATE VIEW archived_result AS SELECT * FROM archived_line_result WHERE leads = 1;
CREATE VIEW archived_use AS
    SELECT u.kind AS used_kind, u.identity, u.name, a.*, u.created_utc AS used_utc
    FROM used u JOIN archived_job a ON a.job_id = u.job;
CREATE VIEW archive_today AS
    SELECT substr(a.changed_utc, 1, 10) AS day, a.* FROM archived_job a;
CREATE VIEW archive_month AS
    SELECT part, characteristic, month, simulated, unit, count(*) AS parts, avg(value) AS mean,
        min(value) AS least, max(value) AS most, min(low) AS low, min(high) AS high,
        avg(step) / 1.1283791670955126 AS sigma_within, avg(uncertainty) AS mean_u
    FROM (SELECT {limits}, value, uncertainty, month,
            abs(value - lag(value) OVER (PARTITION BY {limits}, month
                ORDER BY created_utc, job_id)) AS step
        FROM (SELECT {limits}, value, uncertainty, created_utc, job_id,
                substr(created_utc, 1, 7) AS month,
                row_number() OVER (PARTITION BY {limits}, CASE WHEN serial = '' THEN job_uuid ELSE serial END
                    ORDER BY created_utc DESC, job_id DESC) AS place
            FROM archived_result WHERE counted = 1 AND state = 'finished') o
        WHERE place = 1) v
    GROUP BY {limits}, month;
CREATE VIEW archive_station AS
    SELECT s.name AS station, s.host, s.since_utc,
        (SELECT max(j.received_utc) FROM job j WHERE j.station = s.name) AS last_received_utc
    FROM station s;
CREATE VIEW archive_station_key AS
    SELECT k.station, k.key, k.proof, k.since_utc FROM station_key k;
CREATE VIEW archive_mark AS
    SELECT m.id, m.job_uuid, m.kind, m.holds, m.why, m.who, m.utc, m.finding, m.role,
        m.received_utc
    FROM mark m;
CREATE VIEW archive_characteristic AS WITH RECURSIVE p (part) AS (
        SELECT min(r.part) FROM result r
        UNION ALL SELECT (SELECT min(r.part) FROM result r WHERE r.part > p.part)
        FROM p WHERE p.part IS NOT NULL),
    c (part, characteristic) AS (
        SELECT p.part, (SELECT min(r.characteristic) FROM result r WHERE r.part = p.part)
        FROM p WHERE p.part IS NOT NULL
        UNION ALL SELECT c.part, (SELECT min(r.characteristic) FROM result r
            WHERE r.part = c.part AND r.characteristic > c.characteristic)
        FROM c WHERE c.characteristic IS NOT NULL)
    SELECT part, characteristic FROM c WHERE characteristic IS NOT NULL;
