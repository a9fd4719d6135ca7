"""Nominal geometry and tolerances of CAD models: needs the extra `step`.

In: STEP files. Out: features with targets, the part of a plan, characteristics of its tolerances.

Read `step` (features and part of a STEP file; registers the reader `ocmm.models`), `pmi` (the text
of its tolerances), `drawing` (tolerances as characteristics of a plan, with an account), `profiles`
(points, profiles and alignment by faces of a model), `reach` (places a probe can reach),
`point_files` (points for CAD programs; registers `ocmm.exports`) and `sections` (points near a
plane, as drawings and curves). It imports `ocmm_core` only.
"""

__all__: list[str] = []
