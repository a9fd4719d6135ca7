"""Predictions for a probe, in sentences for terminal and window."""

from __future__ import annotations

from ocmm_core.calibration.probe_design import WrongLabels
from ocmm_core.measuring._probe_report import Mechanics


def label_words(item: WrongLabels) -> str:
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


def label_verdict(labels: tuple[WrongLabels, ...], *, coded: bool) -> str:
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
