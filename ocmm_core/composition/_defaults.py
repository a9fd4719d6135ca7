"""The documents, the source and the seed that stand where nobody names others."""

from __future__ import annotations

from ocmm_core.documents import resource

DEFAULT_SEED = 3

DEFAULT_SOURCE = "simulated"

IN_PROCESS, VIRTUAL_WIRE = "simulated", "EtherCAT, virtual wire"
REAL_WIRE, SERVICE = "EtherCAT on", "EtherCAT, service of this computer"
"""How the names begin by which sources go into recordings."""

DEMO_PLAN = resource("plans", "demo.toml")

RECOMMENDED_RIG = resource("rigs", "recommended.toml")

STANDARD_PROBE = resource("probes", "standard.toml")

DEMO_PART = resource("parts", "demo.toml")
