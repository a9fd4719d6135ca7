"""Virtual rig: cameras, operator and part with known truth, and a simulated bus.

In: documents of a rig, a probe and a part, and a seed. Out: frames, and their ground truth.

Packages from first to last: `slave` (software camera as an EtherCAT slave), `scene` (cameras,
operator and part), `hand` (probe led by the user), `calibration_scenes` (scenes for calibration),
`bus` (software cameras on a wire, and fault injection).
It uses packages up to calibration. Only composition roots import it, so that no product code can
depend on simulated truth.
"""

__all__: list[str] = []
