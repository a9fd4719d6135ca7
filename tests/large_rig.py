"""Documents of rigs with many cameras and of bodies with many LEDs, made from the shipped ones.

The layout follows from the number alone: places are drawn with a fixed generator, LEDs at least
12 mm apart, as an LED in its housing needs.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.label_scenes import rig_with
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float

_APART_MM = 12.0


def write_rig(folder: Path, n_cameras: int) -> Path:
    """Write the recommended rig with more cameras on a wall, all turned to the middle."""
    shipped = resource("rigs", "recommended.toml")
    head, first, *_ = shipped.read_text(encoding="utf-8").split("[[cameras]]")
    fixed = [line for line in first.splitlines() if line.split(" ")[0] not in _OWN]
    parts = [head]
    rig = rig_with(load_rig(shipped), n_cameras)
    for number, camera in enumerate(rig.cameras, start=1):
        turn = Rotation.from_matrix(camera.T_camera_from_world.rotation).as_rotvec()
        parts.append(
            f'[[cameras]]\nname = "c{number}"\nserial = {20600000 + number}\nalias = {number}\n'
            f"centre = {_row(camera.centre_world)}\nrotation_vector = {_row(turn)}\n"
            + "\n".join(fixed)
            + "\n"
        )
    path = folder / f"rig{n_cameras}.toml"
    path.write_text("".join(parts), encoding="utf-8")
    return path


def write_probe(folder: Path, n_leds: int) -> Path:
    """Write the standard probe with other LEDs."""
    head = resource("probes", "standard.toml").read_text(encoding="utf-8").split("[[leds]]")[0]
    path = folder / f"probe{n_leds}.toml"
    path.write_text(head + _leds(n_leds, np.array([0.0, 0.0, 170.0])), encoding="utf-8")
    return path


def write_reference(folder: Path, n_leds: int) -> Path:
    """Write the reference body `plate` with other LEDs."""
    text = resource("references", "plate.toml").read_text(encoding="utf-8").split("[[leds]]")[0]
    path = folder / f"reference{n_leds}.toml"
    path.write_text(text + _leds(n_leds, np.zeros(3), key=1), encoding="utf-8")
    return path


_OWN = ("name", "serial", "alias", "centre", "rotation_vector", "#")


def _leds(count: int, middle: Float, key: int = 0) -> str:
    rng = np.random.default_rng([count, key])
    reach = np.array([60.0, 30.0, 70.0]) * (count / 16.0) ** (1.0 / 3.0)
    places: list[Float] = []
    while len(places) < count:
        place = rng.uniform(-reach, reach)
        if all(np.linalg.norm(place - other) > _APART_MM for other in places):
            places.append(place)
    return "\n".join(
        f"[[leds]]\nposition = {_row(place + middle)}\ndirection = [0.0, -1.0, 0.0]\n"
        for place in places
    )


def _row(values: Iterable[float]) -> str:
    return f"[{', '.join(f'{value:.12g}' for value in values)}]"
