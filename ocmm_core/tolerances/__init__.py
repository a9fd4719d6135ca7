"""Characteristics: their values, uncertainties and verdicts.

In: measured features, the frame of the part, the characteristics of the plan. Out: value, U with
its budget, and a verdict; or the reason why not.

Packages, each importing only earlier ones: `zones` (elements of characteristics), `kinds` (all
kinds and their values), `uncertainty` (distribution of a value), `decisions` (verdicts) and
`monte_carlo`. The package is independent of whole jobs and plans, and of the display of results.
"""

__all__: list[str] = []
