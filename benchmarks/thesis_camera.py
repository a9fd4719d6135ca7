"""The camera of the thesis measures the whole demo part over the virtual wire.

Its cameras send corrected millimetres in single precision, no counter, no time and no check sum; a
file describes them (`resources/devices/thesis-camera.toml`). Prints error and U of every
characteristic of the demo plan. U is of 95 %, so that one in twenty may be off by more: ends with 1
where more are than chance explains (1 in 1,000), or one by more than one and a half U.
Run: ``python -m benchmarks.thesis_camera [SEED]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from scipy.stats import binom

from ocmm_core.cli.measure import run_job
from ocmm_core.cli.terminal import make_console
from ocmm_core.composition import DEMO_PLAN, StationRequest, build_station, true_values
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError

_SPOTS = '{ index = 0x6000, sub = 1, type = "REAL32", role = ["x", "y"], slots = true }'
_BUTTON = '{ index = 0x6001, sub = 1, type = "USINT", role = ["button"] }'
_FAR = 1.5
_SIZE = "\nheight_px = 2048\n"


def write_rig(folder: Path) -> Path:
    """Write the thesis's camera with a button, which the rig's operator presses, and its rig."""
    text = resource("devices", "thesis-camera.toml").read_text()
    device = folder / "thesis-with-button.toml"
    device.write_text(text.replace(_SPOTS, f"{_SPOTS}, {_BUTTON}"))
    rig = folder / "rig.toml"
    text = resource("rigs", "recommended.toml").read_text()
    rig.write_text(text.replace(_SIZE, f'{_SIZE}device = "{device.name}"\n'))
    return rig


def main() -> int:
    """Measure, and return the exit code."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan = folder / "plan.toml"
        plan.write_text(f'cameras = "unproven"\n{DEMO_PLAN.read_text()}')
        request = StationRequest(
            plan=plan,
            out=folder / "job",
            rig=write_rig(folder),
            source="ethercat:virtual",
            seed=seed,
        )
        built = build_station(request)
        assert built.virtual is not None
        view = run_job(built, folder / "job", make_console())
        truth = true_values(built.station.job.plan, built.virtual.part)
    outside = missing = far = 0
    print(f"{'characteristic':40} {'error um':>10} {'U um':>8}")
    for each in view.characteristics:
        if each.measured is None or each.uncertainty is None or each.name not in truth:
            missing += 1
            print(f"{each.name:40} {'-':>10} {'-':>8}")
            continue
        error = each.measured - truth[each.name]
        outside += abs(error) > each.uncertainty
        far += abs(error) > _FAR * each.uncertainty
        print(f"{each.name:40} {error * 1e3:>10.2f} {each.uncertainty * 1e3:>8.2f}")
    most = int(binom.isf(1e-3, len(view.characteristics), 0.05))
    print(
        f"seed {seed}: {len(view.characteristics)} characteristics, {outside} off by more than U "
        f"({most} by chance at most), {far} by more than {_FAR} U, {missing} not measured; "
        f"the job is {'complete' if view.complete else 'NOT complete'}; "
        f"{len(view.camera_doubts)} doubts of the cameras told"
    )
    return 1 if outside > most or far or missing or not view.complete else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)
