"""The measuring core of OCMM: cameras on a bus to toleranced features, without a screen.

In: spots of the cameras, a plan, the documents of rig and probe, records of calibration.
Out: points, features, verdicts with their uncertainty, job files and reports.

Read the rooms along the data: `camera` and `fieldbus`, `acquisition`, `tracking`, `calibration`,
`measuring`, `features`, `alignment`, `tolerances`, `storage`, `inspection`, `export`, `station`,
`composition`. The modules here serve all of them: errors, geometry, documents, plugins.
A package never imports a later one. The core knows neither Qt nor the packages beside it
(`ocmm_sim`, `ocmm_genicam`, `ocmm_trackers`, `ocmm_cad`, `ocmm_shop`, `ocmm_cli`, `ocmm_gui`,
`ocmm_serve`, `ocmm_bench`), which register what they add (`plugins`).
docs/developer/architecture.md is the map.
"""

__version__ = "0.2.0"

__all__ = ["__version__"]
