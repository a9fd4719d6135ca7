"""Roles of a server: rights of station, reader and quality, as SQL for its owner.

`ocmm_station` adds jobs, deliveries, its own name and the signed ends of its histories; it reads
its arrivals, and the marks and findings to hold jobs by. `ocmm_reader` reads the views, no job
file. `ocmm_quality` reads everything, adds findings and marks, admits the logins of stations, and
replaces computers.

Only the owner may change or delete a row. Column ``role`` names the login that added a row: the
server fills it in (``SESSION_USER``), and no login may set it. Row-level security binds a login to
its stations (`station_login`), its outboxes, its jobs and their rows: it adds nothing in the name
of another station, and uses no number of another outbox.
"""

from __future__ import annotations

from ocmm_shop.archive.records import JobRow, MarkRow, ResultRow
from ocmm_shop.archive.stores._interface import HEADS
from ocmm_shop.archive.stores._schema import VIEW_NAMES
from ocmm_shop.archive.stores._store import Archive

ROLES = ("ocmm_station", "ocmm_reader", "ocmm_quality")

_ADDS = {
    "station": ("name", "machine", "host"),
    "sender": ("outbox", "station", "machine", "username"),
    "file": ("sha256", "size", "content"),
    "job": (*JobRow.__struct_fields__, "sound"),
    "result": ("job", "part", "created_utc", *ResultRow.__struct_fields__),
    "used": ("job", "kind", "identity", "name", "created_utc"),
    "delivery": ("outbox", "sequence", "job", "sha256", "sent_utc", "signature"),
    "station_key": ("station", "key", "proof"),
    "finding": ("kind", "subject", "document", "who", "utc"),
}
_OWN = "{0} IN (SELECT l.station FROM ocmm.station_login l WHERE l.login = SESSION_USER)"
# Columns of rows must agree with their job.
_OF_JOB = (
    "EXISTS (SELECT 1 FROM ocmm.job j WHERE j.id = {0}.job AND j.role = SESSION_USER"
    " AND j.created_utc = {0}.created_utc{1})"
)
_MACHINE = (
    " AND EXISTS (SELECT 1 FROM ocmm.station s WHERE s.name = sender.station"
    " AND s.machine IN ('', sender.machine))"
)
_DELIVERED = (
    "EXISTS (SELECT 1 FROM ocmm.job j JOIN ocmm.sender s ON s.outbox = delivery.outbox"
    " AND s.role = SESSION_USER WHERE j.id = delivery.job AND "
)
_BOUND = {
    "station": _OWN.format("name"),
    "station_key": _OWN.format("station"),
    "sender": _OWN.format("station") + _MACHINE,
    "file": "true",
    "job": _OWN.format("station"),
    "result": _OF_JOB.format("result", " AND j.part = result.part"),
    "used": _OF_JOB.format("used", ""),
    "finding": f"kind = '{HEADS}'",
    "delivery": _DELIVERED + _OWN.format("j.station") + ")",
}
"""Condition for rows added by a station."""


def _policies() -> tuple[str, ...]:
    made: list[str] = []
    for table, condition in _BOUND.items():
        made += [
            f"ALTER TABLE ocmm.{table} ENABLE ROW LEVEL SECURITY",
            f"DROP POLICY IF EXISTS read_all ON ocmm.{table}",
            f"DROP POLICY IF EXISTS add_own ON ocmm.{table}",
            # Grants decide which login reads which table.
            f"CREATE POLICY read_all ON ocmm.{table} FOR SELECT USING (true)",
            f"CREATE POLICY add_own ON ocmm.{table} FOR INSERT TO ocmm_station"
            f" WITH CHECK ({condition})",
        ]
    return (
        *made,
        "DROP POLICY IF EXISTS judge ON ocmm.finding",
        "CREATE POLICY judge ON ocmm.finding FOR INSERT TO ocmm_quality WITH CHECK (true)",
        "DROP POLICY IF EXISTS replace ON ocmm.station",
        "CREATE POLICY replace ON ocmm.station FOR UPDATE TO ocmm_quality USING (true)",
    )


def role_statements() -> tuple[str, ...]:
    """Return the SQL that creates the three roles and their rights; idempotent."""
    views = ", ".join(f"ocmm.{name}" for name in VIEW_NAMES)
    made = tuple(
        f"DO $$ BEGIN CREATE ROLE {role} NOLOGIN; EXCEPTION WHEN duplicate_object THEN NULL; END $$"
        for role in ROLES
    )
    everybody = ", ".join(ROLES)
    return (
        *made,
        # For an administrator only: by default everyone may fill a new database's disk with large
        # objects.
        "DO $$ BEGIN REVOKE EXECUTE ON FUNCTION pg_catalog.lo_create(oid),"
        " pg_catalog.lo_creat(integer), pg_catalog.lo_from_bytea(oid, bytea) FROM PUBLIC;"
        " EXCEPTION WHEN insufficient_privilege THEN NULL; END $$",
        # By default everyone may fill a new database's disk with temporary tables.
        "DO $$ BEGIN EXECUTE format('REVOKE TEMPORARY ON DATABASE %I FROM PUBLIC',"
        " current_database()); REVOKE CREATE ON SCHEMA public FROM PUBLIC;"
        " EXCEPTION WHEN insufficient_privilege OR invalid_schema_name THEN NULL; END $$",
        "REVOKE ALL ON SCHEMA ocmm FROM PUBLIC",
        "REVOKE ALL ON ALL TABLES IN SCHEMA ocmm FROM PUBLIC",
        f"REVOKE ALL ON ALL TABLES IN SCHEMA ocmm FROM {everybody}",
        f"GRANT USAGE ON SCHEMA ocmm TO {everybody}",
        f"GRANT SELECT ON ocmm.migration TO {everybody}",
        f"GRANT SELECT ON {views} TO {everybody}",
        *(
            f"GRANT INSERT ({', '.join(columns)}) ON ocmm.{table} TO ocmm_station"
            for table, columns in _ADDS.items()
        ),
        "GRANT SELECT ON ocmm.station, ocmm.station_login, ocmm.station_key, ocmm.sender, ocmm.job,"
        " ocmm.delivery, ocmm.mark, ocmm.finding TO ocmm_station",
        "GRANT SELECT (sha256, size) ON ocmm.file TO ocmm_station",
        "GRANT SELECT ON ALL TABLES IN SCHEMA ocmm TO ocmm_quality",
        "GRANT INSERT (kind, subject, document, who, utc) ON ocmm.finding TO ocmm_quality",
        f"GRANT INSERT ({', '.join(MarkRow.__struct_fields__)}) ON ocmm.mark TO ocmm_quality",
        "GRANT UPDATE (machine, host) ON ocmm.station TO ocmm_quality",
        "GRANT INSERT (login, station) ON ocmm.station_login TO ocmm_quality",
        *_policies(),
    )


def roles_sql() -> str:
    """Return the same as a script, with an example of logins."""
    return (
        ";\n".join(role_statements()) + ";\n\n-- One login for each station and person, e.g.:\n"  # noqa: S608
        "-- CREATE ROLE station3 LOGIN PASSWORD '...' IN ROLE ocmm_station;\n"
        "-- INSERT INTO ocmm.station_login (login, station) VALUES ('station3', 'Station 3');\n"
        "-- CREATE ROLE grafana LOGIN PASSWORD '...' IN ROLE ocmm_reader;\n"
        "-- CREATE ROLE anna LOGIN PASSWORD '...' IN ROLE ocmm_quality;\n"
    )


def give_roles(archive: Archive) -> None:
    """Create the three roles on the server of an archive; by its owner. A file has none."""
    archive.give_roles(role_statements())
