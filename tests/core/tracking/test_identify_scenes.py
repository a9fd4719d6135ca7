"""Random poses with hidden LEDs and reflections; the full million is `benchmarks.labels`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.label_layouts import ambiguous_layout
from benchmarks.label_scenes import draw_scenes, mirrored, together
from benchmarks.labels import (
    layouts_taken,
    mirror_images,
    random_poses,
    reflections,
    search,
    shipped_rig,
    two_bodies,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tracking import IdentifyOptions, identify, load_probe, spot_sigma_px
from ocmm_core.tracking._ambiguity import check_distinct
from ocmm_core.tracking._identify import identify_all
from ocmm_core.tracking._strobe import NOT_NAMED

PROBES = sorted(resource("probes").glob("*.toml"))
STANDARD4 = resource("probes", "standard4.toml")
PLATE = resource("references", "plate.toml")


@pytest.mark.parametrize("n_cameras", [2, 3, 4])
@pytest.mark.parametrize("probe", PROBES, ids=lambda path: path.stem)
def test_no_wrong_tip_is_accepted(
    probe: Path, n_cameras: int, record_property: Callable[[str, object], None]
) -> None:
    found = random_poses(probe, ("recommended", n_cameras), 6000, seed=77)
    record_property("accepted", found.accepted)
    record_property("frames", found.frames)
    assert found.wrong == 0
    # A fifth to a half of the frames has four LEDs in two cameras, most of them are named; where
    # only three are, a fourth in one camera is enough in many.
    assert found.accepted > 0.75 * found.enough


def test_two_bodies_are_named_in_one_frame() -> None:
    found = two_bodies(STANDARD4, PLATE, 6000, seed=78)
    assert found.wrong == 0
    assert found.accepted > 0.75 * found.enough


def test_no_slot_is_given_to_two_bodies() -> None:
    rig, probe = shipped_rig("recommended", 2), load_probe(STANDARD4).led_body
    # The same four LEDs again: under any names they are two bodies in one place.
    twin = replace(probe, name="twin")
    with pytest.raises(InputError) as caught:
        check_distinct((probe, twin))
    assert caught.value.code == "bodies.alike"
    sigma = spot_sigma_px(rig)
    scenes, _ = together(np.random.default_rng(79), rig, (probe, twin), 200, sigma_px=sigma)
    for spots in scenes.spots:
        for found in identify_all(rig, (probe, twin), spots, IdentifyOptions(sigma)):
            assert found.slot_of_led is None


@pytest.mark.parametrize("probe", ["standard", "standard4"])
def test_a_mirror_image_is_no_probe(probe: str) -> None:
    found = mirror_images(resource("probes", f"{probe}.toml"), 3000, seed=80)
    assert found.enough > 1000
    assert found.accepted == 0


def test_a_flat_body_without_symmetry_is_not_its_mirror_image_either() -> None:
    """Its mirror image is a body that is turned over, and its LEDs would face away."""
    rig, probe = shipped_rig("recommended", 2), load_probe(STANDARD4)
    flat = replace(
        probe.led_body,
        leds_body=probe.leds_probe * [1.0, 0.0, 1.0],
        led_directions_body=np.tile([0.0, -1.0, 0.0], (4, 1)),
    )
    rng = np.random.default_rng(81)
    sigma = spot_sigma_px(rig)
    for body, named in ((flat, True), (mirrored(flat), False)):
        scenes = draw_scenes(rng, rig, body, 1000, sigma_px=sigma, hidden=False, ghosts=False)
        found = search(rig, [flat], probe.tip_probe, scenes)
        assert (found.accepted > 500) == named
        assert named or found.accepted == 0


def test_a_fit_never_gives_a_reflection() -> None:
    assert reflections(20_000, seed=82) == 0


def test_ambiguous_layouts_are_all_refused() -> None:
    assert layouts_taken(150, seed=83) == 0
    sizes = {len(ambiguous_layout(np.random.default_rng(seed))) for seed in range(100)}
    assert sizes == {3, 4, 5, 6, 7, 8}


def test_a_code_tells_a_symmetric_flat_body_from_its_mirror_image() -> None:
    rig, probe = shipped_rig("recommended", 2), load_probe(resource("probes", "thesis.toml"))
    body = replace(probe.led_body, rules=())
    rng = np.random.default_rng(84)
    sigma = spot_sigma_px(rig)
    for seen, named in ((body, True), (mirrored(body), False)):
        scenes = draw_scenes(rng, rig, seen, 200, sigma_px=sigma, hidden=False, ghosts=False)
        answers = 0
        for spots, slots in zip(scenes.spots, scenes.slots, strict=True):
            led_of_slot = np.full((2, 8), NOT_NAMED)
            for camera, led in np.argwhere(slots >= 0):
                led_of_slot[camera, slots[camera, led]] = led
            options = IdentifyOptions(sigma)
            without = identify(rig, body, spots, options)
            assert without.slot_of_led is None
            found = identify(rig, body, spots, options, led_of_slot)
            answers += found.slot_of_led is not None
        assert (answers > 100) == named
        assert named or answers == 0
