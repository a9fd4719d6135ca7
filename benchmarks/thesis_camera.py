"""The camera of the thesis measures the whole demo part: how often is a result off by more than U.

Its cameras send corrected millimetres in single precision, no counter, no time and no check sum; a
file describes them (`resources/devices/thesis-camera.toml`). The seeds count from 1 on. In each the
numbers go through the very bytes of that camera and back, without a wire; the first frames of each
are compared with those of the software camera and of the bus. The first seeds are measured over the
virtual wire as well.

U is of 95 %. Ends with 1 where the share that is off by more is certainly above 5 %, where more are
off by 1.5 U than the tail of three standard deviations explains (1 in 1,000), or where something
was not measured. Run: ``python -m benchmarks.thesis_camera [SEEDS [OVER_THE_WIRE]]``.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binom, binomtest, norm

from ocmm_core.blas import use_one_thread

use_one_thread()

from ocmm_cli.measure import run_job  # noqa: E402
from ocmm_cli.study import touch_all  # noqa: E402
from ocmm_cli.terminal import make_console  # noqa: E402
from ocmm_core.acquisition.frames import FrameBlock  # noqa: E402
from ocmm_core.camera import CameraModel, load_rig  # noqa: E402
from ocmm_core.cluster import Site, run_tasks  # noqa: E402
from ocmm_core.composition import (  # noqa: E402
    DEMO_PART,
    DEMO_PLAN,
    STANDARD_PROBE,
    StationRequest,
    build_station,
)
from ocmm_core.documents import resource  # noqa: E402
from ocmm_core.errors import OcmmError  # noqa: E402
from ocmm_core.fieldbus.described import (  # noqa: E402
    DeviceDescription,
    InputTranslator,
    ProcessImage,
    Timing,
    corrected_from_pixels,
    load_device,
    pixels_from_corrected,
    resting_doubt_mm,
)
from ocmm_core.fieldbus.device import Intrinsics, decode_spots, encode_frames  # noqa: E402
from ocmm_core.geometry import Float  # noqa: E402
from ocmm_core.inspection.evaluation import SessionOptions  # noqa: E402
from ocmm_core.inspection.plan import load_plan  # noqa: E402
from ocmm_core.inspection.session import InspectionSession  # noqa: E402
from ocmm_core.measuring import PointOptions, TouchCollector  # noqa: E402
from ocmm_core.storage import JobFile, make_head  # noqa: E402
from ocmm_core.tracking import TrackingPipeline, load_probe  # noqa: E402
from ocmm_sim.scene import VirtualRig, load_part  # noqa: E402
from ocmm_sim.slave import DescribedCamera  # noqa: E402
from ocmm_sim.sources import true_values  # noqa: E402

SEEDS, OVER_THE_WIRE = 40, 2
_SPOTS = '{ index = 0x6000, sub = 1, type = "REAL32", role = ["x", "y"], slots = true }'
_BUTTON = '{ index = 0x6001, sub = 1, type = "USINT", role = ["button"] }'
_FAR = 1.5
_SIZE = "\nheight_px = 2048\n"
_COMPARED = 50
"""Frames of each seed that are compared with those of the parts of the bus."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One characteristic of one seed: error and U, mm; NaN if not measured."""

    name: str
    error: float
    uncertainty: float

    @property
    def ratio(self) -> float:
        """Return the error in units of U."""
        return abs(self.error) / self.uncertainty


def write_rig(folder: Path) -> Path:
    """Write the thesis's camera with a button, which the rig's operator presses, and its rig."""
    text = resource("devices", "thesis-camera.toml").read_text()
    device = folder / "thesis-with-button.toml"
    device.write_text(text.replace(_SPOTS, f"{_SPOTS}, {_BUTTON}"))
    rig = folder / "rig.toml"
    text = resource("rigs", "recommended.toml").read_text()
    rig.write_text(text.replace(_SIZE, f'{_SIZE}device = "{device.name}"\n'))
    return rig


def over_the_wire(seed: int) -> list[Outcome]:
    """Measure with the software cameras on the virtual wire, in real processes."""
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
    return [
        _outcome(each.name, each.measured, each.uncertainty, truth) for each in view.characteristics
    ]


def without_wire(seed: int) -> list[Outcome]:
    """Measure with the same numbers, without wire and processes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = write_rig(folder)
        plan, part = load_plan(DEMO_PLAN), load_part(DEMO_PART)
        rig, body = load_rig(path), load_probe(STANDARD_PROBE)
        device = load_device(rig.device)
        lenses = [Intrinsics.from_camera(camera, 0).model() for camera in rig.cameras]
        touches = [(feature.name, feature.points) for feature in plan.features]
        rate = round(1e9 / device.period_ns)
        virtual = VirtualRig(rig, body, part, touches, seed, frame_rate_hz=rate)
        compare(virtual, device, lenses)
        pipeline = TrackingPipeline(rig, body)
        options = PointOptions(untimed_mm=resting_doubt_mm(device))
        collector = TouchCollector(virtual.frame_period_ns * 1e-9, options)
        head = make_head(
            plan=DEMO_PLAN, rig=path, probe=STANDARD_PROBE, operator="", part="", serial=""
        )
        with JobFile.create(folder / "job.ocmm", head) as job:
            session = InspectionSession(plan, rig, body, job, SessionOptions(point=options))
            touch_all(
                virtual, touches, session, pipeline, collector,
                lambda block: as_sent(block, device, lenses),
            )  # fmt: skip
            view = session.view
        truth = true_values(plan, part)
        return [
            _outcome(each.name, each.measured, each.uncertainty, truth)
            for each in view.characteristics
        ]


def as_sent(
    block: FrameBlock, device: DeviceDescription, lenses: Sequence[CameraModel]
) -> FrameBlock:
    """Return frames as they arrive from the cameras of the thesis."""
    uv = np.empty_like(block.uv)
    for camera, lens in enumerate(lenses):
        uv[:, camera] = _through(block.uv[:, camera], device, lens)
    return FrameBlock(block.counter, block.time_ns, block.flags, block.valid, uv)


def _through(uv: Float, device: DeviceDescription, lens: CameraModel) -> Float:
    """Return pixels as they arrive: corrected, in single precision, led back, in steps."""
    sent = np.nan_to_num(corrected_from_pixels(lens, uv, device.sends)).astype("<f4")
    back = pixels_from_corrected(lens, sent.astype(np.float64), device.sends)
    seen = (sent != 0.0).any(axis=-1)
    bits = (seen << np.arange(uv.shape[1])).sum(axis=1).astype(np.uint16)
    return decode_spots(encode_frames(bits, np.zeros(len(bits), np.uint16), back))


def compare(virtual: VirtualRig, device: DeviceDescription, lenses: Sequence[CameraModel]) -> None:
    """Stop if the first frames differ from those of the software camera, read as on the bus."""
    image = ProcessImage(device)
    for number, lens in enumerate(lenses):
        camera = DescribedCamera(number, 1, 1, virtual, device, lens)
        camera.start_ns, camera.period_ns = 1, device.period_ns
        reader = InputTranslator(device, image, 1, lens, Timing(0, device.period_ns, 0))
        ours = as_sent(virtual.frames(0, _COMPARED), device, lenses).uv[:, number]
        for frame in range(_COMPARED):
            content = camera.inputs(frame)
            spots = decode_spots(encode_frames(*reader.spots(content)))[0]
            np.testing.assert_array_equal(ours[frame], spots)


def _outcome(
    name: str, measured: float | None, uncertainty: float | None, truth: dict[str, float]
) -> Outcome:
    if measured is None or uncertainty is None or name not in truth:
        return Outcome(name, np.nan, np.nan)
    return Outcome(name, measured - truth[name], uncertainty)


def report(title: str, runs: Iterable[Sequence[Outcome]]) -> bool:
    """Print the shares outside U; say whether they are as they have to be."""
    by_name: dict[str, list[Outcome]] = defaultdict(list)
    for outcomes in runs:
        for one in outcomes:
            by_name[one.name].append(one)
    print(f"\n{title}")
    print(f"{'characteristic':40} {'N':>5} {'off by > U':>11} {'worst / U':>10} {'RMS / U':>8}")
    for name, found in by_name.items():
        ratios = np.array([one.ratio for one in found])
        print(
            f"{name:40} {len(found):>5} {np.count_nonzero(ratios > 1.0):>11} "
            f"{np.nanmax(ratios):>10.2f} {np.sqrt(np.nanmean(ratios**2)):>8.2f}"
        )
    ratios = np.array([one.ratio for found in by_name.values() for one in found])
    count, missing = len(ratios), int(np.count_nonzero(np.isnan(ratios)))
    outside = int(np.count_nonzero(ratios > 1.0))
    far = int(np.count_nonzero(ratios > _FAR))
    low, high = binomtest(outside, count).proportion_ci(0.95)
    by_chance = int(binom.isf(1e-3, count, 2.0 * norm.sf(2.0 * _FAR)))
    print(
        f"{outside} of {count} off by more than U: {100 * outside / count:.1f} % (95 % interval "
        f"{100 * low:.1f} to {100 * high:.1f} %); {far} by more than {_FAR} U "
        f"({by_chance} by chance at most); {missing} not measured"
    )
    return bool(low <= 0.05 and far <= by_chance and not missing)


def main() -> int:
    """Measure, and return the exit code."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    wired = int(sys.argv[2]) if len(sys.argv) > 2 else OVER_THE_WIRE
    runs = []
    for answer in run_tasks(
        without_wire, range(1, seeds + 1), lambda seed: f"The measurement with seed {seed}",
        site=Site(workers=os.cpu_count()),
    ):  # fmt: skip
        if isinstance(answer, OcmmError):
            raise answer
        runs.append(answer)
    kept = report(f"The bytes of the camera, seeds 1 to {seeds}", runs) if runs else True
    over = [over_the_wire(seed) for seed in range(1, wired + 1)]
    if over:
        kept &= report(f"Over the virtual wire, seeds 1 to {wired}", over)
    return 0 if kept else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OcmmError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)
