"""A shop of several stations: archive, cluster, recalls over the archive, and studies.

In: finished jobs of stations. Out: rows and files of all jobs, trends, recalls and gauge studies.

Read `archive` (jobs of all stations, in a file or on PostgreSQL), `archiving` (uploads of a running
station), `recalls` (later findings applied to archived jobs), `cluster` (Dask; registers
`ocmm.clusters`) and `studies` (measurement system analysis; registers `ocmm.records`). The extra
`shop` brings PostgreSQL and Dask. It imports `ocmm_core` only.
"""

__all__: list[str] = []
