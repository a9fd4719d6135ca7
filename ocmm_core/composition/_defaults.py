"""The documents, the source and the seed that stand where nobody names others."""

from __future__ import annotations

from ocmm_core.documents import resource

DEFAULT_SEED = 3

DEFAULT_SOURCE = "simulated"

DEMO_PLAN = resource("plans", "demo.toml")

RECOMMENDED_RIG = resource("rigs", "recommended.toml")

STANDARD_PROBE = resource("probes", "standard.toml")

DEMO_PART = resource("parts", "demo.toml")
