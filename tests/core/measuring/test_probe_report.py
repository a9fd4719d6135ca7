"""Report about a probe before it is built: mechanics, budget, colours of the maps, words."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.probe_design import (
    Postures,
    ProbeDesign,
    TipMap,
    WrongLabels,
    compression,
    load_design,
    shipped_design,
    side_load,
)
from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.measuring import (
    Examination,
    Mechanics,
    ProbeReport,
    colour_at,
    examine,
    label_verdict,
    label_words,
    map_range,
)
from ocmm_core.measuring._probe_report import mechanics_of, mechanics_words
from ocmm_core.tracking import Ambiguity, ProbeBody, load_probe

POSTURES = Postures((20.0, 20.0, 20.0), np.array([[-50.0, -50.0, -50.0], [50.0, 50.0, 50.0]]))


@pytest.fixture(scope="module")
def probe() -> ProbeBody:
    return load_probe(resource("probes", "thesis.toml"))


@pytest.fixture(scope="module")
def design(probe: ProbeBody) -> ProbeDesign:
    path = shipped_design(probe)
    assert path is not None
    return load_design(path, probe)


@pytest.fixture(scope="module")
def found(design: ProbeDesign, probe: ProbeBody) -> Mechanics:
    return mechanics_of(design, probe)


@pytest.fixture(scope="module")
def report(recommended: Rig, probe: ProbeBody, design: ProbeDesign) -> ProbeReport:
    asked = Examination(POSTURES, poses=50, cells=3)
    return examine(recommended, probe, design, asked)


def test_ball_and_hand_carry_the_weight_and_its_moment(
    found: Mechanics, design: ProbeDesign
) -> None:
    ball, hand = found.reactions_n
    assert ball + hand == pytest.approx(found.weight_n, rel=1e-9)
    assert 0.0 < ball < hand < found.weight_n  # the heavy panel is at the handle
    assert found.handle_mm == design.handle_mm


def test_the_lines_end_in_the_numbers(found: Mechanics, design: ProbeDesign) -> None:
    """The lines begin at the ball; 1 N on it moves nothing at the handle."""
    assert found.x_mm[0] == 0.0
    assert found.side_line_nm[0] == pytest.approx(found.side_nm_per_n, rel=1e-12)
    held = int(np.argmin(np.abs(found.x_mm - design.handle_mm)))
    # The grid meets the handle within a step.
    assert abs(found.side_line_nm[held]) < 0.02 * found.side_nm_per_n
    # Errata of the thesis: 321 nm/N from the handle with g = 9.8; stiffness is independent of g.
    assert found.side_nm_per_n == pytest.approx(
        1e6 * side_load(design.beam, design.handle_mm).deflection_mm[0], rel=1e-12
    )
    assert 200.0 < found.side_nm_per_n < 500.0


def test_a_probe_is_stiffest_along_itself(found: Mechanics, design: ProbeDesign) -> None:
    assert 0.0 < found.axial_nm_per_n < found.side_stiff_nm_per_n < found.side_nm_per_n
    expected = 1e6 * compression(design.beam, 0.0, design.handle_mm)
    assert found.axial_nm_per_n == pytest.approx(expected, rel=1e-12)


def test_leds_are_told_by_their_way_from_the_ball(found: Mechanics, probe: ProbeBody) -> None:
    ways = np.linalg.norm(probe.leds_probe - probe.tip_probe, axis=1)
    assert len(found.leds_mm) == probe.n_leds
    assert all(0.0 < along <= way for along, way in zip(found.leds_mm, ways, strict=True))


def test_mechanics_are_put_in_words(found: Mechanics) -> None:
    words = " ".join(mechanics_words(found))
    ball, hand = found.reactions_n
    assert f"the ball carries {ball:.3f} N and the hand {hand:.3f} N" in words
    assert f"{found.axial_nm_per_n:.1f} nm/N" in words


def test_a_report_holds_every_part(report: ProbeReport, probe: ProbeBody) -> None:
    assert (report.probe, report.n_leds, report.coded) == (probe.name, probe.n_leds, False)
    assert len(report.maps) == 3
    assert report.mechanics is not None
    assert report.number.space_um == pytest.approx(np.linalg.norm(report.number.axes_um), rel=1e-9)
    assert [item.hidden for item in report.labels] == list(range(probe.n_leds + 1))


def test_the_budget_follows_what_it_rests_on(
    report: ProbeReport, recommended: Rig, probe: ProbeBody, design: ProbeDesign
) -> None:
    terms = {term.name: term.sigma_um for term in report.budget}
    assert len(terms) == len(report.budget) == 8
    assert all(np.isfinite(value) and value > 0.0 for value in terms.values())
    twice = replace(
        recommended,
        parameter_covariance=4.0 * recommended.parameter_covariance,
        noise=msgspec.structs.replace(recommended.noise, white_px=2.0 * recommended.noise.white_px),
    )
    asked = report.examination
    bare = examine(twice, probe, None, asked)
    assert bare.mechanics is None
    assert [term.name for term in bare.budget] == [term.name for term in report.budget[:4]]
    doubled = {term.name: term.sigma_um for term in bare.budget}
    for name in ("Noise of the spots", "Calibration of the cameras"):
        assert doubled[name] == pytest.approx(2.0 * terms[name], rel=1e-9)
    for name in ("Pattern of the sensors", "Calibration of the probe"):
        assert doubled[name] == pytest.approx(terms[name], rel=1e-9)
    pushed = replace(design, contact_force_n=3.0 * design.contact_force_n)
    force = examine(recommended, probe, pushed, asked).budget[-1]
    assert force.sigma_um == pytest.approx(3.0 * terms[force.name], rel=1e-9)


def test_colours_go_from_dark_to_bright_through_their_scale() -> None:
    # The ends and the steps between are the colours of the scale themselves.
    assert [colour_at(share) for share in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)] == [
        "#440154", "#414487", "#2a788e", "#22a884", "#7ad151", "#fde725",
    ]  # fmt: skip
    assert (colour_at(-1.0), colour_at(2.0)) == (colour_at(0.0), colour_at(1.0))
    # Half way between two, rounded.
    assert colour_at(0.9) == "#bcdc3b"
    green = [int(colour_at(share)[3:5], 16) for share in np.linspace(0.0, 1.0, 50)]
    assert green == sorted(green)


def test_maps_share_one_scale(report: ProbeReport) -> None:
    low, high = map_range(report.maps)
    every = np.concatenate([item.space_um.ravel() for item in report.maps])
    assert (low, high) == (np.nanmin(every), np.nanmax(every))
    blind: TipMap = replace(report.maps[0], space_um=np.full_like(report.maps[0].space_um, np.nan))
    assert map_range([blind]) == (0.0, 1.0)
    even = replace(blind, space_um=np.full_like(blind.space_um, 2.0))
    assert map_range([blind, even]) == (2.0, 2.001)


def test_labels_are_put_in_words() -> None:
    safe = WrongLabels(0, None)
    close = WrongLabels(3, Ambiguity((1, 0, 3, 4), 0.25, 12.0))
    assert label_words(safe) == "All LEDs seen: no wrong order is possible."
    assert label_words(close) == (
        "LED 3 hidden: nearest wrong order 2 1 4 5 misses by 0.25 mm and would put the tip "
        "12 mm off."
    )
    assert label_verdict((safe,), coded=False) == "The LEDs cannot be confused."
    assert label_verdict((safe, close), coded=False).startswith("AMBIGUOUS with LED 3 hidden")
    assert label_verdict((replace(close, hidden=0),), coded=False).startswith("AMBIGUOUS: the LEDs")
    assert "strobe code" in label_verdict((close,), coded=True)
