"""Inspection: from a plan to an evaluated job, and back to it later.

In: a plan, touches with their tracked frames, job files. Out: points, results, guidance, causes.

Packages, in order: `plan` (what to measure), `evaluation` (points to results), `causes` (why a
result is not good), `session` (the running job), `archive` (reopened and compared jobs) and
`recall` (after a calibration failed). None imports a later one.
It must not know reports, threads, sockets or screens: those are `export`, `station`, `ocmm_gui`.
"""

__all__: list[str] = []
