"""Parallel tasks, here or on remote computers.

In: a function of a module, its inputs, bytes that it needs. Out: the result of each input, in
order, bit-identical for any number of workers.

Read `_site`: the one function and its routes, where to compute, and restrictions; Dask is added by
`ocmm_shop`. It must not know what is computed; seeds belong to tasks, never to
workers.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_core.cluster._site import HERE, Cluster, Site, has_dask, run_tasks
else:
    __getattr__ = door(__name__)

__all__ = ["HERE", "Cluster", "Site", "has_dask", "run_tasks"]
