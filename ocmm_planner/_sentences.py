"""Sentences of a planned rig for terminal and paper."""

from __future__ import annotations

from collections import Counter

from ocmm_planner._sheet import BASE_GAIN, RigSheet, SheetFigures

_SHORTEST_US = 1.0


def sheet_sentences(sheet: RigSheet) -> list[str]:
    """Return the sentences of a result, the most important first."""
    best, told = sheet.best, _figures(sheet.best)
    said = [f"U of the tip (k = 2, longest half axis): {told}"]
    if best.length_worst_um is not None:
        said.append(
            f"U of a length of {sheet.length:g} mm along X, Y or Z: worst "
            f"{best.length_worst_um:.1f} µm, median {best.length_median_um:.1f} µm."
        )
    said += [
        f"{count} of {best.nodes} nodes have no number. {why}"
        for why, count in best.without.items()
    ]
    said.append(
        f"LEDs seen by two cameras over {sheet.attitudes} attitudes: {best.leds_fewest} at least, "
        f"{best.leds_mean:.1f} on average."
    )
    if sheet.is_moved:
        told = _figures(sheet.given)
        said.append(f"This is the best of {sheet.evaluations} placements tried.")
        said.append(f"The given placement: {told}")
        if sheet.given.measurable == sheet.given.nodes and best.worst_um and sheet.given.worst_um:
            gain = 100.0 * (1.0 - best.worst_um / sheet.given.worst_um)
            said.append(f"The best placement has a worst U smaller by {gain:.0f} %.")
    elif sheet.evaluations:
        said.append(f"None of {sheet.evaluations} placements tried is better than the given one.")
    percent, told = round(100.0 * (BASE_GAIN - 1.0)), _figures(sheet.wider)
    said.append(f"With {percent} % more base, also where no camera may be: {told}")
    said += [
        f"Without camera '{camera.name}': {told}"
        for camera, told in zip(sheet.cameras, map(_figures, sheet.one_less), strict=True)
    ]
    said += _hardware(sheet)
    said.append(
        "Not included: temperature, force of the hand, form of the part, vibration, and errors of "
        "the catalogue. The calibration is assumed as planned; verify the real rig."
    )
    return said


def shopping_list(sheet: RigSheet) -> list[str]:
    """Return the articles to buy, with their numbers."""
    wanted = Counter(name for one in sheet.cameras for name in (one.camera, one.lens))
    return [f"{count} x {name}" for name, count in wanted.items()]


def _figures(found: SheetFigures) -> str:
    if found.why or found.worst_um is None:
        return found.why or "No node has a number."
    return (
        f"worst {found.worst_um:.1f} µm, median {found.median_um:.1f} µm, at {found.measurable} of "
        f"{found.nodes} nodes."
    )


def _hardware(sheet: RigSheet) -> list[str]:
    blur, faintest, brightest = sheet.best.light
    said = [] if blur is None else [f"Blur by defocus: {blur:.1f} px at most."]
    if faintest is None or brightest is None:
        said.append("Light is not known: the plan has no section [light], or no LED is seen.")
    else:
        said.append(
            f"Spots fill {100.0 * faintest:.0f} to {100.0 * brightest:.0f} % of a pixel, within a "
            "factor of two."
        )
    said += [
        f"Camera '{one.name}' needs less than {_SHORTEST_US:g} µs of exposure: dim the LEDs or "
        "close the stop."
        for one in sheet.cameras
        if one.exposure_us is not None and one.exposure_us < _SHORTEST_US
    ]
    load = max(one.load for one in sheet.cameras)
    highest = min(one.highest_rate_hz for one in sheet.cameras)
    said.append(
        f"Links: {100.0 * load:.0f} % loaded at {sheet.rate_hz:g} exposures a second; "
        f"{highest:.0f} are possible."
    )
    if highest < sheet.rate_hz:
        said.append("TOO FAST: lower rate_hz in the plan, or take other cameras or links.")
    return said
