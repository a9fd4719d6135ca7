"""The measuring core of OCMM: cameras on a bus to toleranced features, without a screen.

In: spots of the cameras, a plan, the documents of rig and probe, records of calibration.
Out: points, features, verdicts with their uncertainty, job files and reports.

Read the rooms along the data: `camera` and `fieldbus`, `acquisition`, `tracking`, `calibration`,
`measuring`, `features`, `alignment`, `tolerances`, `storage`, `inspection`, `export`, `station`,
`composition`, `cli`. `simulation` stands beside them. The files here are rooms of one file that
everybody may use: errors, geometry, documents and the door itself.
A package never imports a later one; the core never imports Qt (docs/developer/architecture.md).
"""

__version__ = "0.2.0"

__all__ = ["__version__"]
