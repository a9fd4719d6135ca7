-- Tables of an archive; words in braces are store-specific. Released files are never changed.
CREATE TABLE migration (
        version {whole} PRIMARY KEY,
        applied_utc {text} NOT NULL DEFAULT {now},
        program {text} NOT NULL);
CREATE TABLE station (
        name {text} PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 300),
        machine {text} NOT NULL,
        host {text} NOT NULL,
        since_utc {text} NOT NULL DEFAULT {now});
CREATE TABLE sender (
    outbox {text} PRIMARY KEY CHECK (length(outbox) = 36),
    station {text} NOT NULL REFERENCES station (name),
    machine {text} NOT NULL,
    username {text} NOT NULL,
    role {text} NOT NULL DEFAULT {who},
    since_utc {text} NOT NULL DEFAULT {now});
CREATE TABLE file (
        sha256 {text} PRIMARY KEY CHECK (length(sha256) = 64),
        size {whole} NOT NULL CHECK (size = length(content)),
        content {blob} NOT NULL{hash_check});
CREATE TABLE job (
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
    UNIQUE (job_uuid, steps, head, sound));
CREATE INDEX job_by_day ON job (changed_utc);
CREATE INDEX job_by_station ON job (station, changed_utc);
CREATE TABLE result (
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
        CHECK (why_not <> '' OR value IS NOT NULL));
CREATE INDEX result_by_characteristic ON result (part, characteristic, created_utc);
CREATE TABLE used (
        job {whole} NOT NULL REFERENCES job (id),
        kind {text} NOT NULL CHECK (kind IN
            ('calibration', 'tip', 'probe', 'artefact', 'rig', 'plan', 'reference')),
        identity {text} NOT NULL, name {text} NOT NULL,
        created_utc {text} NOT NULL,
        PRIMARY KEY (job, kind, identity));
CREATE INDEX used_by_identity ON used (kind, identity, created_utc);
CREATE INDEX used_by_name ON used (kind, name, created_utc);
CREATE TABLE delivery (
    outbox {text} NOT NULL REFERENCES sender (outbox),
    sequence {whole} NOT NULL CHECK (sequence > 0),
    job {whole} NOT NULL REFERENCES job (id),
    sha256 {text} NOT NULL,
    sent_utc {text} NOT NULL,
    received_utc {text} NOT NULL DEFAULT {now},
    role {text} NOT NULL DEFAULT {who},
    PRIMARY KEY (outbox, sequence));
CREATE INDEX delivery_by_job ON delivery (job);
CREATE TABLE finding (
        id {id},
        kind {text} NOT NULL, subject {text} NOT NULL, document {text} NOT NULL,
        who {text} NOT NULL, utc {text} NOT NULL,
        role {text} NOT NULL DEFAULT {who},
        received_utc {text} NOT NULL DEFAULT {now});
CREATE TABLE mark (
        id {id},
        job_uuid {text} NOT NULL,
        kind {text} NOT NULL CHECK (kind IN ('altered', 'recall', 'quality')),
        holds {whole} NOT NULL CHECK (holds IN (0, 1)),
        why {text} NOT NULL, who {text} NOT NULL, utc {text} NOT NULL,
        finding {whole} NOT NULL DEFAULT 0,
        role {text} NOT NULL DEFAULT {who},
        received_utc {text} NOT NULL DEFAULT {now});
CREATE INDEX mark_by_job ON mark (job_uuid, kind, id);
