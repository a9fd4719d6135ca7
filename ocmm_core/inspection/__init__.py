"""Plan, job and what follows from it: from a plan to an evaluated job, and back to it later.

In: a plan, touches with their tracked frames, job files. Out: points, results, guidance, causes.

Rooms, from the first to the last: `plan` (what to measure), `evaluation` (from the points of a job
to results), `causes` (why a result is not good), `session` (the job while it is measured),
`archive` (jobs reopened and compared) and `recall` (after a calibration failed). None imports a
later one.
It must not know reports, threads, sockets or screens: those are `export`, `station`, `ocmm_gui`.
"""

__all__: list[str] = []
