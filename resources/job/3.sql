-- The public key and the signature are Base64.
CREATE TABLE seal (
        sequence INTEGER PRIMARY KEY REFERENCES audit (sequence),
        key TEXT NOT NULL, signature TEXT NOT NULL) STRICT;
