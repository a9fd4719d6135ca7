-- Binds rows to login, station, key and outbox; readers judge signers.
-- Of an older archive: the only login that sent under a name is that station.
CREATE TABLE station_login (
        login {text} NOT NULL CHECK (length(login) BETWEEN 1 AND 300),
        station {text} NOT NULL CHECK (length(station) BETWEEN 1 AND 300),
        role {text} NOT NULL DEFAULT {who},
        since_utc {text} NOT NULL DEFAULT {now},
        PRIMARY KEY (login, station));
CREATE TABLE station_key (
        station {text} NOT NULL REFERENCES station (name),
        key {text} NOT NULL CHECK (length(key) BETWEEN 1 AND 300),
        proof {text} NOT NULL CHECK (length(proof) BETWEEN 1 AND 300),
        role {text} NOT NULL DEFAULT {who},
        since_utc {text} NOT NULL DEFAULT {now},
        PRIMARY KEY (station, key));
INSERT INTO station_login (login, station)
        SELECT min(role), station FROM sender GROUP BY station HAVING min(role) = max(role);
UPDATE job SET seal = 'SIGNED' WHERE seal IN ('SEALED', 'UNKNOWN KEY');
CREATE INDEX job_by_part ON job (part, created_utc);
