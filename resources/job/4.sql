-- The nominal part in the form of `ocmm_core.part_model`.
CREATE TABLE part (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        source_name TEXT NOT NULL, source_sha256 TEXT NOT NULL,
        content BLOB NOT NULL) STRICT;
