-- The reference body: document, first pose, and spots of every point.
-- Mean spots of its first pose, little-endian float64; shape "cameras,leds,2".
CREATE TABLE reference (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        text TEXT NOT NULL, sha256 TEXT NOT NULL,
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL, n_frames INTEGER NOT NULL) STRICT;
CREATE TABLE reference_observation (
        number INTEGER PRIMARY KEY REFERENCES observation (number),
        spots_shape TEXT NOT NULL, spots BLOB NOT NULL) STRICT;
