"""Planner of rigs: uncertainty, sight, light and places of cameras before they are bought.

In: a document of volume, probe, attitudes and cameras from a catalogue, and their permitted places.
Out: a map of U over the volume, the best placement found, changes of it, and their sentences.

Read `_plan` (the document, and the catalogue of cameras and lenses), `_prediction` (spots: what
hides an LED, light, blur, noise; U of tip and length; best placement), then `_sheet`
(all of it, with changes, as JSON, and its sentences). It must not know files of models, jobs or the
bus.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_planner._plan import RigPlan, load_rig_plan
    from ocmm_planner._prediction import (
        RigMap, Scene, placement_cost, predict_map, predict_tips, scene_of, search_places,
        shared_covariance, spots_of,
    )  # fmt: skip
    from ocmm_planner._sheet import (
        RigSheet, evaluate_plan, map_from_above, maps_of, read_sheet, sheet_sentences,
        shopping_list,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "RigMap", "RigPlan", "RigSheet", "Scene", "evaluate_plan", "load_rig_plan", "map_from_above",
    "maps_of", "placement_cost", "predict_map", "predict_tips", "read_sheet", "scene_of",
    "search_places", "shared_covariance", "sheet_sentences", "shopping_list", "spots_of",
]  # fmt: skip
