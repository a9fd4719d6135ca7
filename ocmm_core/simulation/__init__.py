"""The virtual rig: cameras, operator and part with known truth, and the cameras' end of the bus.

In: documents of a rig, a probe and a part, and a seed. Out: frames, and the truth behind them.

Rooms, from the first to the last: `slave` (the software camera as an EtherCAT slave), `scene`
(cameras, operator and part), `hand` (somebody else leads the probe), `calibration_scenes` (what is
shown while the rig is calibrated),
`bus` (software cameras on a wire, and what can be made to fail).
It uses rooms up to calibration. Only composition roots import it, so that nothing in the product
can rest on a truth that exists only here.
"""

__all__: list[str] = []
