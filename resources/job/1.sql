-- Tables of a job; files are compared with this text, so it never changes.
-- Arrays are little-endian float64, row by row. Their shapes: tip_world and direction (3),
-- covariance and rotation (3, 3), spots by spots_shape ("cameras,leds,2").
CREATE TABLE head (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        job_uuid TEXT NOT NULL, created_utc TEXT NOT NULL, software_version TEXT NOT NULL,
        operator TEXT NOT NULL, part TEXT NOT NULL, serial TEXT NOT NULL,
        plan_text TEXT NOT NULL, plan_sha256 TEXT NOT NULL,
        rig_text TEXT NOT NULL, rig_sha256 TEXT NOT NULL,
        probe_text TEXT NOT NULL, probe_sha256 TEXT NOT NULL) STRICT;
CREATE TABLE observation (
        number INTEGER PRIMARY KEY CHECK (number > 0),
        feature TEXT NOT NULL, time_s REAL NOT NULL,
        first_frame INTEGER NOT NULL, last_frame INTEGER NOT NULL, n_frames INTEGER NOT NULL,
        tip_world BLOB NOT NULL CHECK (length(tip_world) = 24),
        random_covariance BLOB NOT NULL CHECK (length(random_covariance) = 72),
        direction BLOB NOT NULL CHECK (length(direction) = 24),
        tip_radius REAL NOT NULL,
        rotation_world_from_probe BLOB NOT NULL CHECK (length(rotation_world_from_probe) = 72),
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL,
        chi2_per_dof REAL NOT NULL, approach TEXT NOT NULL) STRICT;
CREATE TABLE annulment (
        number INTEGER PRIMARY KEY REFERENCES observation (number),
        time_utc TEXT NOT NULL, reason TEXT NOT NULL) STRICT;
CREATE TABLE event (
        id INTEGER PRIMARY KEY, time_utc TEXT NOT NULL,
        kind TEXT NOT NULL, text TEXT NOT NULL) STRICT;
CREATE TABLE audit (
        sequence INTEGER PRIMARY KEY, time_utc TEXT NOT NULL,
        subject TEXT NOT NULL, key INTEGER NOT NULL, content_sha256 TEXT NOT NULL,
        previous TEXT NOT NULL, hash TEXT NOT NULL) STRICT;
