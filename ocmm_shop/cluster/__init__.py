"""Parallel tasks on the workers of a Dask scheduler, or on local ones.

In: tasks of `ocmm_core.cluster`. Out: their answers, from workers of the same build and arithmetic.

Read `_over_dask` (a scheduler and its workers), `_open_tasks` (open tasks and the bytes sent for
them; replaces lost workers), `_worker` (runs on a worker), `no_page` (a preload: no HTTP
server). It must not know what is computed.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.cluster._over_dask import DASK
    from ocmm_shop.cluster._worker import versions
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["DASK", "versions"]
