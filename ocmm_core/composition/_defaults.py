"""Default documents, source and seed."""

from __future__ import annotations

from ocmm_core.documents import resource

DEFAULT_SEED = 3

DEFAULT_SOURCE = "simulated"

IN_PROCESS, VIRTUAL_WIRE = "simulated", "EtherCAT, virtual wire"
REAL_WIRE, SERVICE = "EtherCAT on", "EtherCAT, service of this computer"
"""Prefixes of these source names in recordings."""

DEMO_PLAN = resource("plans", "demo.toml")

RECOMMENDED_RIG = resource("rigs", "recommended.toml")

STANDARD_PROBE = resource("probes", "standard.toml")

DEMO_PART = resource("parts", "demo.toml")
