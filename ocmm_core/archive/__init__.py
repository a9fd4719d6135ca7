"""The archive of a shop: every job with its file and its rows, in a file or on a PostgreSQL server.

In: finished and paused jobs of many stations. Out: the same files, rows and views that answer what
was measured where, when, by whom, with what; marks of what became known later.

Rooms, from the first to the last: `records` (what is kept of a job), `stores` (where it is kept),
then beside each other `outbox` (how jobs come), `questions` (what it is for) and `checks` (made
anew from files alone, and held against them). None imports a later one.
It must not know a running station: jobs come through an outbox, and measuring never waits.
"""

__all__: list[str] = []
