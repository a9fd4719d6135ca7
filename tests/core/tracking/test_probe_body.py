from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rigid_fit, rotation_from_vector, rotation_xyz
from ocmm_core.tracking import ProbeBody, load_probe, nearest_ambiguity, satisfies_rules

pytestmark = pytest.mark.numerics


def document(tmp_path: Path, leds: list[tuple[float, float, float]], rules: str = "") -> Path:
    head = resource("probes", "standard.toml").read_text(encoding="utf-8").split("[[leds]]")[0]
    entries = "".join(
        f"[[leds]]\nposition = [{x}, {y}, {z}]\ndirection = [0.0, -1.0, 0.0]\n" for x, y, z in leds
    )
    path = tmp_path / "probe.toml"
    path.write_text(head + entries + rules, encoding="utf-8")
    return path


def refused(path: Path, code: str) -> InputError:
    with pytest.raises(InputError) as caught:
        load_probe(path)
    assert caught.value.code == code
    assert str(path) in caught.value.what
    assert caught.value.remedy
    return caught.value


def test_rigid_fit_finds_the_motion_and_never_a_reflection() -> None:
    rng = np.random.default_rng(1)
    for flat in (False, True):
        for _ in range(200):
            body = rng.normal(size=(4, 3)) * [50.0, 0.0 if flat else 50.0, 50.0]
            rotation = rotation_from_vector(rng.normal(size=3))
            shift = 100.0 * rng.normal(size=3)
            noisy = body @ rotation.T + shift + 0.01 * rng.normal(size=(4, 3))
            found, origin = rigid_fit(body, noisy)
            assert np.linalg.det(found) == pytest.approx(1.0, abs=1e-12)
            # Noise of 0.01 mm over some 20 mm at the worst draw of points, and its lever.
            assert np.abs(found - rotation).max() < 0.02
            assert np.abs(body @ found.T + origin - noisy).max() < 0.1


@pytest.mark.parametrize(("name", "leds_of"), [("standard", 6), ("thesis", 4)])
def test_nearest_ambiguity_is_the_least_of_all_permutations(name: str, leds_of: int) -> None:
    """The search skips orders by a bound; here none is skipped."""
    body = load_probe(resource("probes", f"{name}.toml"))
    leds = body.leds_probe
    assert len(leds) == leds_of
    least = np.inf
    for labels in list(permutations(range(leds_of)))[1:]:
        rotation, origin = rigid_fit(leds, leds[list(labels)])
        if any(axis @ rotation @ axis < -0.99 for axis, _ in body.rules):
            continue
        miss = leds @ rotation.T + origin - leds[list(labels)]
        least = min(least, float(np.sqrt(np.mean(np.sum(miss**2, axis=1)))))
    worst = nearest_ambiguity(body)
    assert worst is not None
    assert worst.residual_mm == pytest.approx(least, abs=1e-9)
    if name == "standard":
        assert worst.residual_mm > 20.0  # the probe document states 25


def test_a_square_is_ambiguous_and_says_by_how_much(tmp_path: Path) -> None:
    square = [(-50.0, 0.0, 118.0), (-50.0, 0.0, 218.0), (50.0, 0.0, 118.0), (50.0, 0.0, 218.0)]
    error = refused(document(tmp_path, square), "probe.ambiguous")
    assert "tip" in error.what


def test_a_mirrored_body_is_ambiguous_only_if_flat(tmp_path: Path) -> None:
    flat = [(-50.0, 0.0, 118.0), (50.0, 0.0, 118.0), (0.0, 0.0, 228.0)]
    refused(document(tmp_path, flat), "probe.ambiguous")
    # The same exchange is a reflection of this one, and no motion makes a reflection.
    deep = [*flat, (0.0, -40.0, 160.0), (30.0, 25.0, 200.0)]
    assert load_probe(document(tmp_path, deep)).n_leds == 5


def rule(axis: str, world: str) -> str:
    return f"[[orientation_rules]]\nprobe_axis = {axis}\nworld_direction = {world}\n"


X, Z = "[1.0, 0.0, 0.0]", "[0.0, 0.0, 1.0]"


@pytest.mark.parametrize(
    ("rules", "accepted"),
    [("", False), (rule(Z, Z), False), (rule(X, X), False), (rule(Z, Z) + rule(X, X), True)],
)
def test_the_rectangle_needs_both_rules(tmp_path: Path, rules: str, accepted: bool) -> None:
    rectangle = [(-50.0, 0.0, 118.0), (-50.0, 0.0, 228.0), (50.0, 0.0, 118.0), (50.0, 0.0, 228.0)]
    path = document(tmp_path, rectangle, rules)
    if accepted:
        assert len(load_probe(path).rules) == 2
    else:
        refused(path, "probe.ambiguous")


def test_rules_judge_attitudes() -> None:
    body = load_probe(resource("probes", "thesis.toml"))
    attitudes: Float = np.stack(
        [
            rotation_xyz(0.0, 0.0, 0.0),
            rotation_xyz(1.2, 0.0, 0.0),
            rotation_xyz(np.pi, 0.0, 0.0),
            rotation_xyz(0.0, np.pi, 0.0),
            rotation_xyz(0.0, 0.0, np.pi),
            np.full((3, 3), np.nan),
        ]
    )
    assert satisfies_rules(body, attitudes).tolist() == [True, True, False, False, False, False]
    without: ProbeBody = replace(body, rules=())
    assert satisfies_rules(without, attitudes[:5]).all()


@pytest.mark.parametrize(
    ("leds", "named"),
    [
        ([(0.0, 0.0, 100.0), (50.0, 0.0, 100.0)], "2 LED"),
        ([(10.0 * i, i * i, 100.0) for i in range(65)], "field 'leds' of the probe has 65 LED"),
        ([(0.0, 0.0, 100.0), (1.0, 0.0, 100.0), (50.0, 0.0, 180.0)], "leds[0] and leds[1]"),
        ([(0.0, 0.0, 100.0), (1.0, 0.0, 140.0), (0.0, 0.0, 228.0)], "one line"),
    ],
)
def test_leds_that_cannot_be_tracked_are_refused(
    tmp_path: Path, leds: list[tuple[float, float, float]], named: str
) -> None:
    assert named in refused(document(tmp_path, leds), "probe.leds").what


def test_four_of_five_leds_that_look_alike_are_refused(tmp_path: Path) -> None:
    """The fifth LED distinguishes the corners of the rectangle, until it is hidden."""
    corners = [(-50.0, 0.0, 118.0), (-50.0, 0.0, 228.0), (50.0, 0.0, 118.0), (50.0, 0.0, 228.0)]
    error = refused(document(tmp_path, [*corners, (20.0, 25.0, 150.0)]), "probe.ambiguous")
    assert "with one LED hidden" in error.what
    assert "LED 4 is not seen" in error.what
    skew = [(-50.0, 0.0, 118.0), (-44.0, 0.0, 228.0), (63.0, 0.0, 118.0), (50.0, 0.0, 210.0)]
    assert load_probe(document(tmp_path, [*skew, (20.0, 25.0, 150.0)])).n_leds == 5


def test_three_leds_are_too_few_without_a_code(tmp_path: Path) -> None:
    triangle = [(-50.0, 0.0, 118.0), (-40.0, 0.0, 228.0), (63.0, 0.0, 150.0)]
    assert "reflection" in refused(document(tmp_path, triangle), "probe.leds").what
