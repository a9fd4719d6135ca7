"""Parallel tasks, here or on remote computers (Dask).

In: a function of a module, its inputs, bytes that it needs. Out: the result of each input, in
order, bit-identical for any number of workers.

Read `_site` (where to compute, and restrictions), `_tasks` (the one function, and its routes),
`_over_dask` (a scheduler and its workers), `_open_tasks` (open tasks; replaces lost workers),
`_contents` (bytes sent to workers), `_worker` (runs on a worker), `no_page` (a preload: no HTTP
server), `_sentences`. It must not know what is computed; seeds belong to tasks, never to workers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.cluster._site import HERE, Site, has_dask
    from ocmm_core.cluster._tasks import run_tasks
    from ocmm_core.cluster._worker import versions
else:
    __getattr__ = door(__name__, _site="HERE Site has_dask", _tasks="run_tasks", _worker="versions")

__all__ = ["HERE", "Site", "has_dask", "run_tasks", "versions"]
