"""Prediction for a probe before it is built: tip error, maps, labels, budget, and sentences."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration import probe_design
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.measuring._factors import systematic_covariance
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivities

_UM, _NM = 1e3, 1e6

Step = Callable[[str, float], None]
"""Called with the next step and the finished share."""


@dataclass(frozen=True, slots=True)
class Examination:
    """Options of the examination."""

    postures: probe_design.Postures
    sigma_px: float = 0.0105
    """Noise of an averaged spot."""
    poses: int = 4000
    cells: int = 25
    everything_seen: bool = False
    """LEDs that face away count as seen."""
    seed: int = 1


@dataclass(frozen=True, slots=True)
class Mechanics:
    """Thermal and elastic behaviour of a design, without cameras."""

    growth_um_per_k: float
    """Of the whole probe (thesis, appendix A)."""
    tip_um_per_k: float
    """Tip error per kelvin, uncompensated."""
    bow_um_per_k: float
    """Tip error per kelvin between the faces of the panel, as from a warm hand."""
    weight_n: float
    reactions_n: tuple[float, float]
    """`weight_n`, `reactions_n`: Of the probe; of ball and handle when it is level (appendix B.1).
    """
    sag_nm: float
    """Tip error from sag of the level probe."""
    side_nm_per_n: float
    side_stiff_nm_per_n: float
    axial_nm_per_n: float
    """`side_nm_per_n`, `side_stiff_nm_per_n`, `axial_nm_per_n`: Deflection of the ball by a force
    across the panel, along it, and along the probe."""
    tip_nm_per_n: float
    """Tip error by a force across the panel."""
    upright_nm: float
    """Shortening by its own weight when upright on its ball (appendix B.2)."""
    x_mm: Float
    sag_line_nm: Float
    side_line_nm: Float
    """`x_mm`, `sag_line_nm`, `side_line_nm`: Positions along the probe, with sag and deflection by
    1 N on the ball."""
    handle_mm: float
    leds_mm: tuple[float, ...]
    """`handle_mm`, `leds_mm`: Positions of hand and LEDs along the probe."""


@dataclass(frozen=True, slots=True)
class ProbeReport:
    """Result of the examination."""

    probe: str
    rig: str
    n_leds: int
    examination: Examination
    number: probe_design.TipNumber
    """Tip error from spot noise alone."""
    maps: tuple[probe_design.TipMap, ...]
    """Over tilt, and over the volume from above and from the front."""
    labels: tuple[probe_design.WrongLabels, ...]
    """Nearest wrong labelling with all LEDs, then with each of them hidden."""
    coded: bool
    """A strobe code identifies the LEDs, independent of their positions."""
    mechanics: Mechanics | None
    """None without a design."""
    budget: tuple[BudgetTerm, ...]
    """Error sources of one point; those of the design only with one."""


def examine(
    rig: Rig,
    body: ProbeBody,
    design: probe_design.ProbeDesign | None,
    asked: Examination,
    step: Step = lambda what, share: None,
) -> ProbeReport:
    """Return the prediction for a probe seen by a rig; takes a few seconds."""
    view = probe_design.View(rig, body, asked.sigma_px, asked.everything_seen)
    step("Number", 0.0)
    number = probe_design.tip_number(view, asked.postures, asked.poses, asked.seed)
    step("Map of the tilt", 0.1)
    maps = [probe_design.tilt_map(view, asked.postures, asked.cells, asked.seed)]
    for top in (True, False):
        step("Map of the volume", 0.3 if top else 0.5)
        maps.append(probe_design.volume_map(view, asked.postures, asked.cells, asked.seed, top=top))
    step("Labels", 0.7)
    labels = probe_design.wrong_labels(body)
    step("Budget", 0.9)
    return ProbeReport(
        probe=body.name,
        rig=rig.name,
        n_leds=body.n_leds,
        examination=asked,
        number=number,
        maps=tuple(maps),
        labels=labels,
        coded=body.code is not None,
        mechanics=None if design is None else mechanics_of(design, body),
        budget=budget_of(view, design, asked.postures, asked.seed),
    )


def mechanics_of(design: probe_design.ProbeDesign, body: ProbeBody) -> Mechanics:
    """Return growth and bending of a design."""
    level = probe_design.sag(design.beam, (0.0, design.handle_mm))
    pushed = probe_design.side_load(design.beam, design.handle_mm)
    along_panel = probe_design.side_load(design.beam, design.handle_mm, stiff=True)
    forces = probe_design.force_shapes(design, body) @ design.soft_probe
    return Mechanics(
        growth_um_per_k=_UM * design.chain.growth_per_k,
        tip_um_per_k=_UM
        * _length(probe_design.tip_shift(body, probe_design.growth_shape(design, body))),
        bow_um_per_k=_UM
        * _length(probe_design.tip_shift(body, probe_design.bow_shape(design, body))),
        weight_n=design.beam.weight,
        reactions_n=(level.reactions[0], level.reactions[1]),
        sag_nm=_NM * _length(probe_design.tip_shift(body, probe_design.sag_shape(design, body))),
        side_nm_per_n=_NM * float(pushed.deflection_mm[0]),
        side_stiff_nm_per_n=_NM * float(along_panel.deflection_mm[0]),
        axial_nm_per_n=_NM * probe_design.compression(design.beam, 0.0, design.handle_mm),
        tip_nm_per_n=_NM * _length(probe_design.tip_shift(body, forces)),
        upright_nm=_NM * probe_design.upright_shortening(design.beam),
        x_mm=level.x_mm,
        sag_line_nm=_NM * level.deflection_mm,
        side_line_nm=_NM * pushed.deflection_mm,
        handle_mm=design.handle_mm,
        leds_mm=tuple(
            float(value) for value in (body.leds_probe - body.tip_probe) @ design.axis_probe
        ),
    )


def _length(vector: Float) -> float:
    return float(np.linalg.norm(vector))


def label_words(item: probe_design.WrongLabels) -> str:
    """Return the sentence for one case of labels."""
    case = "All LEDs seen" if not item.hidden else f"LED {item.hidden} hidden"
    found = item.ambiguity
    if found is None:
        return f"{case}: no wrong order is possible."
    order = " ".join(str(led + 1) for led in found.labels)
    return (
        f"{case}: nearest wrong order {order} misses by {found.residual_mm:.2f} mm and would put "
        f"the tip {found.tip_error_mm:.0f} mm off."
    )


def label_verdict(labels: tuple[probe_design.WrongLabels, ...], *, coded: bool) -> str:
    """Return whether the LEDs can be confused."""
    if coded:
        return "The strobe code identifies the LEDs independently of their positions."
    unsafe = [item for item in labels if not item.is_safe]
    if not unsafe:
        return "The LEDs cannot be confused."
    if not unsafe[0].hidden:
        return "AMBIGUOUS: the LEDs can be confused. Move one by 10 mm."
    numbers = ", ".join(str(item.hidden) for item in unsafe)
    return f"AMBIGUOUS with LED {numbers} hidden: the others can be confused. Move one by 10 mm."


def mechanics_words(found: Mechanics) -> tuple[str, ...]:
    """Return the thermal and elastic behaviour of a design, in sentences."""
    ball, hand = found.reactions_n
    return (
        f"Growth: {found.growth_um_per_k:.2f} µm/K over the whole probe; uncorrected, the tip "
        f"is off by {found.tip_um_per_k:.2f} µm/K. With one face of the panel warmer, e.g. by a "
        f"hand: {found.bow_um_per_k:.2f} µm/K.",
        f"Weight: {found.weight_n:.2f} N; held level the ball carries {ball:.3f} N and the hand "
        f"{hand:.3f} N, and the tip is {found.sag_nm:.1f} nm off.",
        f"Side force on the ball: compliance {found.side_nm_per_n:.0f} nm/N across the panel "
        f"and {found.side_stiff_nm_per_n:.0f} nm/N along it; the tip is "
        f"{found.tip_nm_per_n:.0f} nm/N off.",
        f"Force along the probe: {found.axial_nm_per_n:.1f} nm/N. Standing on its ball it is "
        f"{found.upright_nm:.1f} nm shorter.",
    )


_POSES = 60
_WINDOW_FRAMES = 2000
"""A quarter of a second at 8 kHz."""
_KNOWN_SIGMA_K = 0.5


@dataclass(frozen=True, slots=True)
class BudgetTerm:
    """One error source of a point: name, standard uncertainty in space, µm, and basis."""

    name: str
    sigma_um: float
    rests_on: str


def budget_of(
    view: probe_design.View,
    design: probe_design.ProbeDesign | None,
    postures: probe_design.Postures,
    seed: int,
) -> tuple[BudgetTerm, ...]:
    """Return error sources of a point, RMS over the postures, propagated as in `_factors`."""
    rig, body = view.rig, view.body
    found = _sensitivities(view, postures, seed)
    if not found:
        return ()
    bare_rig = replace(rig, parameter_covariance=np.zeros_like(rig.parameter_covariance))
    bare_body = replace(body, geometry_covariance=np.zeros_like(body.geometry_covariance))
    white = rig.noise.white_px / np.sqrt(_WINDOW_FRAMES)

    def by_geometry(covariance: Float) -> float:
        return _rms([item.by_geometry @ covariance @ item.by_geometry.T for item in found])

    terms = [
        BudgetTerm(
            "Noise of the spots",
            _rms([white**2 * _squares(item) for item in found]),
            f"{rig.noise.white_px:g} px a frame, {_WINDOW_FRAMES} frames a point",
        ),
        BudgetTerm(
            "Pattern of the sensors",
            _rms([systematic_covariance([item], bare_rig, bare_body) for item in found]),
            f"{rig.noise.pattern_px:g} px, fixed on the sensor",
        ),
        BudgetTerm(
            "Calibration of the cameras",
            _rms(
                [item.by_cameras @ rig.parameter_covariance @ item.by_cameras.T for item in found]
            ),
            "covariance of the rig document",
        ),
        BudgetTerm(
            "Calibration of the probe",
            by_geometry(body.geometry_covariance),
            "covariance of LEDs and tip",
        ),
    ]
    if design is None:
        return tuple(terms)
    growth = probe_design.growth_shape(design, body)
    weight = probe_design.sag_shape(design, body)
    forces = probe_design.force_shapes(design, body)
    sure = probe_design.Temperature(
        probe_design.REFERENCE_C + design.temperature_range_k, _KNOWN_SIGMA_K, ""
    )
    made = probe_design.Temperature(probe_design.REFERENCE_C, _KNOWN_SIGMA_K, "")
    used = probe_design.body_in_use(
        bare_body, design, probe_design.TemperatureState(sure, made, compensated=True)
    )
    left = used.geometry_covariance - np.outer(weight, weight) / 3.0
    free = design.temperature_range_k**2 / 3.0 * np.outer(growth, growth)
    force = design.contact_force_n**2 / 9.0 * forces @ forces.T
    return (
        *terms,
        BudgetTerm(
            "Temperature of the probe, not measured",
            by_geometry(free),
            f"within ±{design.temperature_range_k:g} K of its calibration",
        ),
        BudgetTerm(
            "Temperature of the probe, compensated",
            by_geometry(left),
            f"instead: {design.temperature_range_k:g} K warmer, known to ±{_KNOWN_SIGMA_K:g} K",
        ),
        BudgetTerm(
            "Weight of the probe", by_geometry(np.outer(weight, weight) / 3.0), "any attitude"
        ),
        BudgetTerm(
            "Force of the hand",
            by_geometry(force),
            f"0 to {design.contact_force_n:g} N from any side",
        ),
    )


def _sensitivities(
    view: probe_design.View, postures: probe_design.Postures, seed: int
) -> tuple[TipSensitivity, ...]:
    rotations, tips = postures.draw(_POSES, np.random.default_rng(seed))
    good = np.isfinite(view.covariance(rotations, tips)[:, 0, 0])
    if not good.any():
        return ()
    return tip_sensitivities(view.spots(rotations, tips)[good], view.rig, view.body)


def _squares(item: TipSensitivity) -> Float:
    by_spots = item.by_spots.reshape(3, -1)
    return by_spots @ by_spots.T


def _rms(covariances: list[Float]) -> float:
    return _UM * float(np.sqrt(np.mean([np.trace(each) for each in covariances])))


_SCALE = np.array(
    [(68, 1, 84), (65, 68, 135), (42, 120, 142), (34, 168, 132), (122, 209, 81), (253, 231, 37)]
)
"""Dark is good, bright is bad; readable without colours, too."""


def colour_at(share: float) -> str:
    """Return the colour of a share from 0 to 1 of the scale, ``#rrggbb``."""
    place = min(max(share, 0.0), 1.0) * (len(_SCALE) - 1)
    low = min(int(place), len(_SCALE) - 2)
    mixed = _SCALE[low] + (place - low) * (_SCALE[low + 1] - _SCALE[low])
    return "#" + "".join(f"{round(float(part)):02x}" for part in mixed)


def map_range(maps: Sequence[probe_design.TipMap]) -> tuple[float, float]:
    """Return smallest and largest value of maps that share a scale, µm."""
    values = np.concatenate([item.space_um.ravel() for item in maps])
    known = values[np.isfinite(values)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return low, max(high, low + 1e-3)
