"""Default documents, source and seed of the table of options, and prefixes of source names."""

from ocmm_core import options, settings

DEFAULT_SEED, DEMO_PART, DEMO_PLAN = options.DEFAULT_SEED, options.DEMO_PART, options.DEMO_PLAN
DEFAULT_SOURCE = settings.DEFAULT_SOURCE
RECOMMENDED_RIG, STANDARD_PROBE = settings.RECOMMENDED_RIG, settings.STANDARD_PROBE

IN_PROCESS, VIRTUAL_WIRE = "simulated", "EtherCAT, virtual wire"
REAL_WIRE, SERVICE = "EtherCAT on", "EtherCAT, service of this computer"
"""Prefixes of these source names in recordings."""
