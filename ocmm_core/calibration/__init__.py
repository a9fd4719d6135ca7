"""Calibration of cameras, probe and tip, and the status of its results.

In: frames of a rig, known points, length bars and spheres with their certificates. Out: sealed
records with covariances, verdicts of verifications, and permission to record points.

Packages, each importing only earlier ones: `probe_design` and `records` (documents, records in
force), `guided` (common part of all procedures), `monitor` (in use), `cameras` (from known points),
`verification`, `bundle` (the adjustment), `tip`, `relocation` (cameras in place), `pivot` (probe
geometry from a sweep) and `sweeping` (its guided form). The package is independent of jobs, plans,
features and the virtual rig.
"""

__all__: list[str] = []
