"""Evaluation of a plan: prediction, best placement found, changes of it, and their sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.build import build_version
from ocmm_core.calibration.probe_design import TipMap
from ocmm_core.camera import Rig, Vector3
from ocmm_core.documents import decode_json, read_bytes
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit
from ocmm_planner import _prediction as prediction
from ocmm_planner._plan import RigPlan
from ocmm_planner._prediction import LINE, RigMap, cost_of, predict_map, search_places

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
    said += _comparison(sheet)
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


def _comparison(sheet: RigSheet) -> list[str]:
    """Return how the calibrated rig differs from its plan, nothing without one."""
    found = sheet.calibrated
    if found is None:
        return []
    told = _figures(found.figures)
    said = [f"As calibrated: {told}"]
    if found.ratios is not None:
        usual, worst = found.ratios
        said.append(
            f"U as calibrated over U of the given placement: median {usual:.2f}, at most "
            f"{worst:.2f}."
        )
    return said + [
        f"Camera '{camera.name}' is {away:.0f} mm from its planned place and looks {turned:.1f}° "
        "away from its planned direction."
        for camera, away, turned in zip(
            sheet.cameras, found.away_mm, found.turned_deg, strict=True
        )
    ]  # fmt: skip


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


SCHEMA = "ocmm.rig_prediction/1"
BASE_GAIN = 1.2
WHY = {
    prediction.OUTSIDE: "LEDs are outside the picture of a camera.",
    prediction.AWAY: "LEDs face away from the cameras.",
    prediction.BLOCKED: "A keep-out box is between LEDs and cameras.",
    prediction.BLURRED: "LEDs are out of focus.",
    prediction.DARK: "LEDs are too dark.",
    LINE: "The visible LEDs are close to one line.",
}
"""Why a node has no number."""


class SheetCamera(msgspec.Struct, frozen=True, kw_only=True):
    """Place of a camera, mm and degrees in the frame of the document.

    Azimuth of the view from +Y towards +X, elevation upwards; ``highest_rate_hz`` of sensor and
    link, ``load`` of the link at the planned rate.
    """

    name: str
    camera: str
    lens: str
    stop: float
    centre: Vector3
    target: Vector3
    azimuth_deg: float
    elevation_deg: float
    roll_deg: float
    focus: float
    exposure_us: float | None
    highest_rate_hz: float
    load: float


class SheetFigures(msgspec.Struct, frozen=True, kw_only=True):
    """Figures of one placement; U (k = 2) in µm, None if no node has a number.

    ``without``: nodes without a number by reason; ``light``: largest blur, px, faintest and
    brightest pixel by the saturation; ``why``: reason for no prediction.
    """

    nodes: int = 0
    measurable: int = 0
    worst_um: float | None = None
    median_um: float | None = None
    length_worst_um: float | None = None
    length_median_um: float | None = None
    leds_fewest: int = 0
    leds_mean: float = 0.0
    light: tuple[float | None, float | None, float | None] = (None, None, None)
    without: dict[str, int] = {}
    why: str = ""


class CalibratedFigures(msgspec.Struct, frozen=True, kw_only=True):
    """The plan with the cameras as calibrated; ``u_um``: U of the tip by node of the sheet, µm.

    ``ratios``: median and largest of U over that of the given placement, at nodes with both;
    ``away_mm``, ``turned_deg``: of each camera from its given place and direction.
    """

    calibration: str
    figures: SheetFigures
    u_um: tuple[float | None, ...]
    ratios: tuple[float, float] | None
    away_mm: tuple[float, ...]
    turned_deg: tuple[float, ...]


class RigSheet(msgspec.Struct, frozen=True, kw_only=True):
    """Prediction of a plan; its JSON is read back by `read_sheet`.

    ``given``: placement in the document; ``best``: the best one found, also of ``cameras`` and of
    the lists by node, U in µm; ``wider``: all centres `BASE_GAIN` times as far from their mean;
    ``one_less``: without each camera.
    """

    schema: str
    software: str
    plan: str
    plan_identity: str
    frame: str
    probe: str
    length: float
    attitudes: int
    rate_hz: float
    evaluations: int
    is_moved: bool
    cameras: tuple[SheetCamera, ...]
    given: SheetFigures
    best: SheetFigures
    wider: SheetFigures
    one_less: tuple[SheetFigures, ...]
    nodes: tuple[Vector3, ...]
    u_um: tuple[float | None, ...]
    length_um: tuple[float | None, ...]
    leds_fewest: tuple[int, ...]
    leds_mean: tuple[float, ...]
    why: tuple[str, ...]
    calibrated: CalibratedFigures | None = None


def evaluate_plan(
    plan: RigPlan, *, seed: int, evaluations: int = 3000, calibrated: Rig | None = None,
    step: Callable[[float], None] = lambda share: None,
) -> RigSheet:  # fmt: skip
    """Return the prediction of a plan.

    ``evaluations`` limits the search, 0 for none; ``calibrated``: rig to be compared with the
    plan; ``step`` gets the finished share. InputError if the calibration does not determine a
    camera of the given placement, or the rig is not that of the plan.
    """
    document, nodes = plan.document, plan.nodes(plan.document.nodes)
    scene = prediction.scene_of(plan, plan.places)
    given = best = predict_map(scene, nodes)
    compared = None if calibrated is None else _calibrated(plan, calibrated, given)
    tried = 0
    if evaluations:
        places, tried = search_places(
            plan, seed=seed, evaluations=evaluations,
            step=lambda share: step(0.8 * share),
        )  # fmt: skip
        moved = prediction.scene_of(plan, places)
        found = predict_map(moved, nodes)
        if cost_of(found) < cost_of(given):
            scene, best = moved, found
    step(0.8)
    placed, wide = scene.places, scene.places.copy()
    wide[:, :3] += (BASE_GAIN - 1.0) * (placed[:, :3] - placed[:, :3].mean(axis=0))
    return RigSheet(
        schema=SCHEMA, software=build_version(), plan=document.name, plan_identity=plan.identity,
        frame=document.frame, probe=plan.probe.name, length=document.length,
        attitudes=len(plan.turns), rate_hz=document.measuring.rate_hz, evaluations=tried,
        is_moved=best is not given,
        cameras=tuple(_camera(scene, index) for index in range(len(plan.cameras))),
        given=_figures_of(given), best=_figures_of(best), wider=_changed(plan, wide, nodes),
        one_less=tuple(_one_less(plan, placed, i, nodes) for i in range(len(plan.cameras))),
        nodes=tuple(map(_vector, best.nodes)), u_um=_um(best.u_tip), length_um=_um(best.u_length),
        leds_fewest=tuple(best.leds.tolist()), leds_mean=tuple(best.leds_mean.round(2).tolist()),
        why=tuple(WHY.get(stage, "") for stage in best.stage.tolist()), calibrated=compared,
    )  # fmt: skip


def read_sheet(path: Path) -> RigSheet:
    """Return the sheet of a JSON file; InputError if it is not one."""
    try:
        found = decode_json(read_bytes(path), RigSheet)
        why = "" if found.schema == SCHEMA else f"field 'schema' is not {SCHEMA!r}"
    except msgspec.MsgspecError as error:
        why = str(error)
    if why:
        raise InputError("rig_plan.sheet", f"{path}: {why}.", "Write it again with ocmm plan rig.")
    return found


def map_from_above(sheet: RigSheet) -> TipMap:
    """Return the worst U over Z for each X and Y, µm; NaN if a node there has no number."""
    return _map("Worst over Z. From above", sheet, sheet.u_um, 0, 1)


def maps_of(sheet: RigSheet) -> tuple[TipMap, ...]:
    """Return the maps from above and from the front; with those of the calibrated rig, if any."""
    found = (map_from_above(sheet), _map("Worst over Y. From the front", sheet, sheet.u_um, 0, 2))
    if sheet.calibrated is None:
        return found
    values = sheet.calibrated.u_um
    return (
        *found,
        _map("As calibrated. From above", sheet, values, 0, 1),
        _map("As calibrated. From the front", sheet, values, 0, 2),
    )


def _map(name: str, sheet: RigSheet, u_um: tuple[float | None, ...], x: int, y: int) -> TipMap:
    """Return the worst U over the third axis for each pair of coordinates ``x`` and ``y``."""
    places = np.array(sheet.nodes)[:, [x, y]]
    columns, rows = np.unique(places[:, 0]), np.unique(places[:, 1])
    values = np.full((len(rows), len(columns)), -np.inf)
    at = np.searchsorted(rows, places[:, 1]), np.searchsorted(columns, places[:, 0])
    np.maximum.at(values, at, [np.nan if one is None else one for one in u_um])
    values[np.isneginf(values)] = np.nan
    return TipMap(name, (f"{'XYZ'[x]} / mm", f"{'XYZ'[y]} / mm"), columns, rows, values)


def _calibrated(plan: RigPlan, rig: Rig, planned: RigMap) -> CalibratedFigures:
    scene = prediction.calibrated_scene(plan, rig)
    found, given = predict_map(scene, planned.nodes), plan.places
    aims = (unit(places[:, 3:] - places[:, :3]) for places in (given, scene.places))
    cosines = np.einsum("ci,ci->c", *aims)
    ratios = found.u_tip / planned.u_tip
    ratios = ratios[np.isfinite(ratios)]
    return CalibratedFigures(
        calibration=rig.identity, figures=_figures_of(found), u_um=_um(found.u_tip),
        ratios=(float(np.median(ratios)), float(ratios.max())) if ratios.size else None,
        away_mm=tuple(np.linalg.norm(scene.places[:, :3] - given[:, :3], axis=1).tolist()),
        turned_deg=tuple(np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).tolist()),
    )  # fmt: skip


def _camera(scene: prediction.Scene, index: int) -> SheetCamera:
    plan, centre, target = scene.plan, scene.places[index, :3], scene.places[index, 3:]
    planned, kind, rate = plan.document.cameras[index], plan.cameras[index], scene.rig.frame_rate_hz
    x, y, z = unit(target - centre)
    on_link = [one for one in plan.cameras if one.shared_link] if kind.shared_link else [kind]
    busy_s = sum(one.frame_bytes / one.link_bytes_s for one in on_link)
    return SheetCamera(
        name=planned.name, camera=kind.name, lens=plan.lenses[index].name, stop=planned.stop,
        centre=_vector(centre), target=_vector(target),
        azimuth_deg=round(float(np.degrees(np.arctan2(x, y))), 2),
        elevation_deg=round(float(np.degrees(np.arcsin(z))), 2), roll_deg=planned.roll_deg,
        focus=round(float(scene.focus[index]), 1), exposure_us=_known(scene.exposure_us[index]),
        highest_rate_hz=min(kind.rate_hz, 1.0 / busy_s), load=rate * busy_s,
    )  # fmt: skip


def _changed(plan: RigPlan, places: Float, nodes: Float) -> SheetFigures:
    try:
        return _figures_of(predict_map(prediction.scene_of(plan, places), nodes))
    except InputError as error:
        return SheetFigures(nodes=len(nodes), why=error.what)


def _one_less(plan: RigPlan, placed: Float, index: int, nodes: Float) -> SheetFigures:
    if len(plan.cameras) == 2:
        return SheetFigures(nodes=len(nodes), why="One camera cannot see depth.")
    return _changed(plan.without(index), np.delete(placed, index, axis=0), nodes)


def _figures_of(found: RigMap) -> SheetFigures:
    tips, lengths = (values[np.isfinite(values)] * 1e3 for values in (found.u_tip, found.u_length))
    why = Counter(WHY[stage] for stage in found.stage.tolist() if stage)
    blur, faintest, brightest = found.light.T
    return SheetFigures(
        nodes=len(found.nodes), measurable=len(tips),
        worst_um=_known(tips.max(initial=-np.inf)), median_um=_known(_median(tips)),
        length_worst_um=_known(lengths.max(initial=-np.inf)),
        length_median_um=_known(_median(lengths)), leds_fewest=int(found.leds.min()),
        leds_mean=float(found.leds_mean.mean()),
        light=(_known(blur.max()), _known(faintest.min()), _known(brightest.max())),
        without=dict(why.most_common()),
    )  # fmt: skip


def _median(values: Float) -> float:
    return float(np.median(values)) if values.size else np.nan


def _known(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None


def _um(values: Float) -> tuple[float | None, ...]:
    return tuple(_known(1e3 * value) for value in values)


def _vector(values: Float) -> Vector3:
    x, y, z = (round(float(value), 3) for value in values)
    return x, y, z
