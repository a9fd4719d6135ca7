"""Two equivalent stores: a file of SQLite, and a PostgreSQL server.

In: rows and files. Out: the same, once each, and answers to read-only SQL.

Read `_interface` (values), `_reader` and `_store` (common code, keys of stations),
`_sqlite` (also opens any archive), `_postgresql` (bounded waits for a silent server), `_address`
(place and password), `_schema` and `_roles` (its SQL), `_faults` (errors as sentences).
It must not know how jobs come, nor which queries exist.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.archive.stores._address import check_address, is_server, parse_server
    from ocmm_shop.archive.stores._faults import Remedy, not_understood, remedy_of
    from ocmm_shop.archive.stores._interface import (
        CLOCK_TELL_S, HEADS, MALFORMED, Acknowledgement, ArchivedDocument, Cell, Receipt, Row,
        Table,
    )  # fmt: skip
    from ocmm_shop.archive.stores._reader import time_of
    from ocmm_shop.archive.stores._roles import ROLES, give_roles, role_statements, roles_sql
    from ocmm_shop.archive.stores._schema import VERSION, VIEW_NAMES
    from ocmm_shop.archive.stores._sqlite import default_archive, open_archive
    from ocmm_shop.archive.stores._store import Archive, stations_by_key, verifies
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CLOCK_TELL_S", "HEADS", "MALFORMED", "ROLES", "VERSION", "VIEW_NAMES", "Acknowledgement",
    "Archive", "ArchivedDocument", "Cell", "Receipt", "Remedy", "Row", "Table", "check_address",
    "default_archive", "give_roles", "is_server", "not_understood", "open_archive", "parse_server",
    "remedy_of", "role_statements", "roles_sql", "stations_by_key", "time_of", "verifies",
]  # fmt: skip
