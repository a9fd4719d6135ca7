"""What virtual sources of frames are called, on the command line and in recordings."""

from __future__ import annotations

PIXEL_BUS = "ethercat:pixels"
VIRTUAL_BUSES = ("ethercat:virtual", PIXEL_BUS)
"""Software cameras on a virtual wire; those of the second compute their pictures."""

VIRTUAL_WIRE = "EtherCAT, virtual wire"
VIRTUAL_NAMES = ("simulated", VIRTUAL_WIRE)
"""How the names begin by which virtual sources go into recordings."""
