"""Virtual rig: cameras, operator and part with known truth, and a simulated bus.

In: documents of a rig, a probe and a part, and a seed. Out: frames, and their ground truth.

Packages from first to last: `slave` (software camera as an EtherCAT slave), `scene` (cameras,
operator and part), `hand` (probe led by the user), `calibration_scenes` (scenes for calibration),
`bus` (software cameras on a wire, and fault injection), `sources` (all of it as frame sources,
registered as `ocmm.sources`) and `practice` (wizards with a virtual hand).
It uses packages of `ocmm_core` up to calibration; `sources` and `practice` alone know stations. No
product code imports it, so that none can depend on simulated truth.
"""

__all__: list[str] = []
