"""Archive of a shop: every job with its file and its rows, in a file or on a PostgreSQL server.

In: finished and paused jobs of many stations. Out: the same files; rows and views for queries by
part, place, time, operator and equipment; marks of later findings.

Packages, in order: `records` (rows of a job), `stores` (storage), then independent of each other
`outbox` (upload), `questions` (queries) and `checks` (rebuild from files, and verification). None
imports a later one.
It must not know a running station: jobs come through an outbox, and measuring never waits.
"""

__all__: list[str] = []
