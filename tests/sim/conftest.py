from __future__ import annotations

from collections.abc import Callable

import pytest

from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.scene import Part, VirtualRig, WorldOptions, load_part
from ocmm_sim.scene._operator import Touches

EVERY_SURFACE: Touches = (
    ("BED", 9),
    ("BLOCK_TOP", 6),
    ("EDGE_1", 5),
    ("CORNER", 2),
    ("SPHERE", 17),
    ("PLATE_TOP", 9),
    ("BORE_A", 8),
    ("BORE_C", 5),
    ("CYLINDER", 12),
    ("CONE", 9),
)

MakeRig = Callable[..., VirtualRig]


@pytest.fixture(scope="session")
def recommended() -> Rig:
    return load_rig(resource("rigs", "recommended.toml"))


@pytest.fixture(scope="session")
def standard() -> ProbeBody:
    return load_probe(resource("probes", "standard.toml"))


@pytest.fixture(scope="session")
def demo_part() -> Part:
    return load_part(resource("parts", "demo.toml"))


@pytest.fixture
def make_rig(recommended: Rig, standard: ProbeBody, demo_part: Part) -> MakeRig:
    def make(
        touches: Touches = (("BED", 2), ("SPHERE", 2)),
        seed: int = 1,
        options: WorldOptions | None = None,
        frame_rate_hz: int | None = None,
    ) -> VirtualRig:
        return VirtualRig(recommended, standard, demo_part, touches, seed, options, frame_rate_hz)

    return make


@pytest.fixture(scope="session")
def every_surface() -> Touches:
    return EVERY_SURFACE
