"""The virtual rig: cameras, operator and part with known truth, and the cameras' end of the bus."""
