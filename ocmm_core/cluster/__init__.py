"""The same work on many things, here or on as many computers as there are (Dask).

In: a function of a module, the things it is about, bytes that it needs. Out: what came of each
thing, in their order, the same digits however many workers there are.

Read `_site` (where the work is done, and what may not be), `_tasks` (the one function, and which
way it takes), `_over_dask` (a scheduler and its workers), `_open_tasks` (what is given out; lost
workers are made up for), `_contents` (bytes that go there), `_worker` (what runs there), `no_page`
(a preload: no HTTP server), `_sentences`. It must not know what is computed; a seed belongs to the
task, never to a worker.
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
