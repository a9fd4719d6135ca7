"""Calibration: cameras, probe and tip, and what may be trusted of them.

In: frames of a rig, known points, length bars and spheres with their certificates.
Out: sealed records with covariances, verdicts of verifications, and whether points may be taken.

Rooms, from the first to the last: `probe_design` and `records` (documents and what is in force),
`guided` (what all procedures share), `monitor` (the watch in use), `cameras` (from known points),
`verification`, `bundle` (the adjustment), `tip`, `relocation` (cameras where they stand), `pivot`
(probe geometry from a sweep) and `sweeping` (the guided form of it). None imports a later one.
Nothing here knows jobs, plans or features. The virtual rig is not known either.
"""

__all__: list[str] = []
