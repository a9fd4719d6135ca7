-- Constraints cannot be dropped, so the table is rebuilt. All of its rows are of one login.
CREATE TABLE job_new (
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
    key {text} NOT NULL DEFAULT '', signature {text} NOT NULL DEFAULT '', UNIQUE (job_uuid, station, steps, head, sound));
INSERT INTO job_new (id, job_uuid, steps, head, sha256, size, station, state, part, serial, order_name, batch, operator, plan, plan_sha256, program, created_utc, changed_utc, rig, calibration, probe, tip, part_c, probe_c, verdict, complete, simulated, points, seal, signer, fault, sound, received_utc, role) SELECT id, job_uuid, steps, head, sha256, size, station, state, part, serial, order_name, batch, operator, plan, plan_sha256, program, created_utc, changed_utc, rig, calibration, probe, tip, part_c, probe_c, verdict, complete, simulated, points, seal, signer, fault, sound, received_utc, role FROM job;
DROP TABLE job;
ALTER TABLE job_new RENAME TO job;
ALTER TABLE delivery ADD COLUMN signature {text} NOT NULL DEFAULT '';
CREATE INDEX job_by_day ON job (changed_utc);
CREATE INDEX job_by_station ON job (station, changed_utc);
CREATE INDEX job_by_arrival ON job (station, received_utc);
