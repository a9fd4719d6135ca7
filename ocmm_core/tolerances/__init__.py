"""Characteristics: their values, uncertainties and verdicts.

In: measured features, the frame of the part, what the plan says of each characteristic.
Out: value, U with its budget, and a verdict; or why there is none.

Rooms, from the first to the last: `zones` (what characteristics are made of), `kinds` (every kind
and its value), `uncertainty` (how a value scatters), `decisions` (verdicts) and `monte_carlo`.
None imports a later one.
It must not know jobs or plans as a whole, nor how a result is shown.
"""

__all__: list[str] = []
