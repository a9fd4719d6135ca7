"""Documents of reference bodies: accepted ones, and refusals with sentences."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import MAX_LEDS
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tracking import ProbeBody, ReferenceBody, check_together, load_probe, load_reference
from tests.large_rig import write_reference

pytestmark = pytest.mark.numerics

Write = Callable[..., Path]
SHIPPED = sorted(resource("references").glob("*.toml"))
GOOD = ((-90.0, -15.0, 0.0), (80.0, 15.0, 10.0), (-35.0, 15.0, 110.0), (50.0, -15.0, 60.0))


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def make(leds: tuple[tuple[float, ...], ...] = GOOD, **fields: object) -> Path:
        head: dict[str, object] = {
            "schema": '"ocmm.reference/1"',
            "unit": '"mm"',
            "name": '"own"',
            "led_sigma": 0.002,
            "emission_half_angle_deg": 60.0,
            **fields,
        }
        lines = [f"{name} = {value}" for name, value in head.items()]
        for led in leds:
            lines += ["[[leds]]", f"position = {list(led)}", "direction = [0.0, -1.0, 0.0]"]
        path = tmp_path / "own.toml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    return make


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_reference_body_goes_with_a_shipped_probe(path: Path) -> None:
    reference = load_reference(path)
    check_together(load_probe(resource("probes", "standard4.toml")), reference)
    assert reference.text == path.read_text(encoding="utf-8")
    assert reference.geometry_covariance.shape == (12, 12)
    assert np.allclose(reference.middle, reference.leds.leds_body.mean(axis=0))


@pytest.mark.parametrize(
    ("leds", "fields", "code"),
    [
        (GOOD[:3], {}, "reference.leds"),
        (GOOD[:2], {}, "reference.leds"),
        ((*GOOD, GOOD[0]), {}, "reference.leds"),
        (tuple((20.0 * i * i, 0.0, 0.0) for i in range(1, 5)), {}, "reference.leds"),
        (((0, 0, 0), (80, 0, 0), (0, 0, 50), (80, 0, 50)), {}, "reference.ambiguous"),
        (GOOD, {"led_sigma": 0.0}, "reference.value"),
        (GOOD, {"emission_half_angle_deg": -5.0}, "reference.value"),
        (GOOD, {"schema": '"ocmm.probe/1"'}, "document.schema"),
        (GOOD, {"tip": "[0.0, 0.0, 0.0]"}, "document.field"),
    ],
)
def test_a_body_that_cannot_be_relied_on_is_refused(
    write: Write, leds: tuple[tuple[float, ...], ...], fields: dict[str, object], code: str
) -> None:
    with pytest.raises(InputError) as caught:
        load_reference(write(leds, **fields))
    assert caught.value.code == code
    assert "own.toml" in caught.value.what


def test_a_rule_makes_a_symmetric_body_unique(write: Write) -> None:
    square = ((0, 0, 0), (80, 0, 0), (0, 0, 50), (80, 0, 50))
    path = write(square)
    rules = "".join(
        f"\n[[orientation_rules]]\nprobe_axis = {axis}\nworld_direction = {axis}\n"
        for axis in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    )
    path.write_text(path.read_text(encoding="utf-8") + rules, encoding="utf-8")
    assert len(load_reference(path).leds.rules) == 2


def test_more_leds_than_can_be_followed_are_refused(
    standard_probe: ProbeBody, tmp_path: Path
) -> None:
    check_together(standard_probe, load_reference(write_reference(tmp_path, MAX_LEDS - 6)))
    with pytest.raises(InputError, match="OCMM follows 64, not 65") as caught:
        check_together(standard_probe, load_reference(write_reference(tmp_path, MAX_LEDS - 5)))
    assert caught.value.code == "reference.slots"


def test_a_large_reference_body_with_four_leds_of_the_probe_is_refused(
    standard_probe: ProbeBody, tmp_path: Path
) -> None:
    """Three LEDs agree by chance among many; four could be named at the wrong places."""
    reference = load_reference(write_reference(tmp_path, 24))
    for shared, refused in ((3, False), (4, True)):
        leds = reference.leds.leds_body.copy()
        leds[-shared:] = standard_probe.leds_probe[:shared]
        body = replace(reference, leds=replace(reference.leds, leds_body=leds))
        if refused:
            with pytest.raises(InputError, match="can be confused with") as caught:
                check_together(standard_probe, body)
            assert caught.value.code == "bodies.alike"
        else:
            check_together(standard_probe, body)


def test_a_reference_body_that_looks_like_the_probe_is_refused(write: Write) -> None:
    probe = load_probe(resource("probes", "standard4.toml"))
    # Three LEDs have the distances of three of the probe's, the fourth does not.
    alike = (*(tuple(led) for led in probe.leds_probe[:3].tolist()), (10.0, 90.0, 20.0))
    reference: ReferenceBody = load_reference(write(alike))
    with pytest.raises(InputError) as caught:
        check_together(probe, reference)
    assert caught.value.code == "bodies.alike"
