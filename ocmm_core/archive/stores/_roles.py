"""The roles of a server: what a station, a reader and quality may do, as SQL for its owner.

`ocmm_station` adds jobs, deliveries and its own name; it reads what it needs to know what arrived,
and the marks and findings that it holds back by. `ocmm_reader` reads the views, no job file.
`ocmm_quality` reads everything, adds findings and marks, and lets a computer be replaced.

Nobody may change or delete a row, but the owner. Who added one stands in its column ``role``, which
the server fills in (``SESSION_USER``) and nobody may give.
"""

from __future__ import annotations

from ocmm_core.archive.records import JobRow, MarkRow, ResultRow
from ocmm_core.archive.stores._store import SqlArchive
from ocmm_core.archive.stores._views import VIEW_NAMES

ROLES = ("ocmm_station", "ocmm_reader", "ocmm_quality")

_ADDS = {
    "station": ("name", "machine", "host"),
    "sender": ("outbox", "station", "machine", "username"),
    "file": ("sha256", "size", "content"),
    "job": (*JobRow.__struct_fields__, "sound"),
    "result": ("job", "part", "created_utc", *ResultRow.__struct_fields__),
    "used": ("job", "kind", "identity", "name", "created_utc"),
    "delivery": ("outbox", "sequence", "job", "sha256", "sent_utc"),
}


def role_statements() -> tuple[str, ...]:
    """Return the SQL that makes the three roles and gives them their rights; may be run again."""
    views = ", ".join(f"ocmm.{name}" for name in VIEW_NAMES)
    made = tuple(
        f"DO $$ BEGIN CREATE ROLE {role} NOLOGIN; EXCEPTION WHEN duplicate_object THEN NULL; END $$"
        for role in ROLES
    )
    everybody = ", ".join(ROLES)
    return (
        *made,
        # By an administrator alone: what everybody may do in a new database is to fill its disk
        # with large objects.
        "DO $$ BEGIN REVOKE EXECUTE ON FUNCTION pg_catalog.lo_create(oid),"
        " pg_catalog.lo_creat(integer), pg_catalog.lo_from_bytea(oid, bytea) FROM PUBLIC;"
        " EXCEPTION WHEN insufficient_privilege THEN NULL; END $$",
        # What everybody may do in a new database: fill its disk with tables of his own.
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
        "GRANT SELECT ON ocmm.station, ocmm.sender, ocmm.job, ocmm.delivery, ocmm.mark, "
        "ocmm.finding TO ocmm_station",
        "GRANT SELECT (sha256, size) ON ocmm.file TO ocmm_station",
        "GRANT SELECT ON ALL TABLES IN SCHEMA ocmm TO ocmm_quality",
        "GRANT INSERT (kind, subject, document, who, utc) ON ocmm.finding TO ocmm_quality",
        f"GRANT INSERT ({', '.join(MarkRow.__struct_fields__)}) ON ocmm.mark TO ocmm_quality",
        "GRANT UPDATE (machine, host) ON ocmm.station TO ocmm_quality",
    )


def roles_sql() -> str:
    """Return the same as a script, with an example of logins."""
    return (
        ";\n".join(role_statements()) + ";\n\n-- One login for each station and person, e.g.:\n"
        "-- CREATE ROLE station3 LOGIN PASSWORD '...' IN ROLE ocmm_station;\n"
        "-- CREATE ROLE grafana LOGIN PASSWORD '...' IN ROLE ocmm_reader;\n"
        "-- CREATE ROLE anna LOGIN PASSWORD '...' IN ROLE ocmm_quality;\n"
    )


def give_roles(archive: SqlArchive) -> None:
    """Make the three roles on the server of an archive; by its owner. A file has none."""
    archive.give_roles(role_statements())
