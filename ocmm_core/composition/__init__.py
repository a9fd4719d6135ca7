"""Composition root: build sources, calibrations and a station from requests.

In: a plan, a source name, temperatures and options from a command or the window.
Out: a prepared source, its calibration, and a station ready to start.

Start with `_compose`. `_sources` has one entry per frame source, `_feed_makers` and `_feeds` make
them, `_calibration_choice` selects the records of a source; `_climate`, `_stream_options`,
`_defaults`, `_from_settings`, `_station_state` do what their names say. `_kernels` lists the
compiled functions, `_compile` compiles them. `_station_checks` measures for the station doctor.
`_calibrate_scenes`, `_acceptance_scenes` and `_truth` serve the virtual rig; `_acceptance_site` and
`_acceptance_bench` build acceptance tests for commands and the window, `hands` shows their frames.
Besides the commands, only this package may import the virtual rig. It must not import commands.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.composition._acceptance_bench import (
        VIRTUAL_ROOM,
        AcceptanceBench,
        Conditions,
        TestsMade,
    )
    from ocmm_core.composition._acceptance_scenes import scenes_of_acceptance
    from ocmm_core.composition._acceptance_site import (
        AcceptanceSite,
        acceptance_feed,
        artefacts_used_before,
        default_test_folder,
        instrument_of,
        named_artefact,
        open_test_site,
        recorded_feed,
        require_recorded,
        require_scenes,
        tests_folder,
    )
    from ocmm_core.composition._calibrate_scenes import (
        VirtualSite,
        relocation_by_step,
        scene_of_tip,
        scenes_of_known_points,
        scenes_of_relocation,
        scenes_of_verification,
        verification_by_step,
    )
    from ocmm_core.composition._calibration_choice import (
        checked_for_replay,
        choose_calibration,
        choose_probe,
    )
    from ocmm_core.composition._climate import ClimateRequest, climate_in_use
    from ocmm_core.composition._compile import compile_all, compile_group
    from ocmm_core.composition._compose import BuiltStation, build_station, calibration_of
    from ocmm_core.composition._defaults import (
        DEFAULT_SEED,
        DEFAULT_SOURCE,
        DEMO_PART,
        DEMO_PLAN,
        RECOMMENDED_RIG,
        STANDARD_PROBE,
    )
    from ocmm_core.composition._feed_makers import identities, script_of, segment_of
    from ocmm_core.composition._feeds import Feed, StationRequest
    from ocmm_core.composition._from_settings import Errand, request_of_settings
    from ocmm_core.composition._kernels import kernel_groups
    from ocmm_core.composition._model_part import part_as_planned, part_text
    from ocmm_core.composition._sources import (
        SOURCES,
        NamedSource,
        Origin,
        SourceSpec,
        make_feed,
        names_in_words,
        origin_of,
        source_help,
        source_of,
    )
    from ocmm_core.composition._station_checks import measured_checks
    from ocmm_core.composition._station_state import StateLine, StationState, station_state
    from ocmm_core.composition._stream_options import stream_options
    from ocmm_core.composition._truth import true_values
else:
    __getattr__ = door(
        __name__,
        _acceptance_bench="AcceptanceBench Conditions TestsMade VIRTUAL_ROOM",
        _acceptance_scenes="scenes_of_acceptance",
        _acceptance_site=(
            "AcceptanceSite acceptance_feed artefacts_used_before default_test_folder "
            "instrument_of named_artefact open_test_site recorded_feed require_recorded "
            "require_scenes tests_folder"
        ),
        _calibrate_scenes=(
            "VirtualSite relocation_by_step scene_of_tip scenes_of_known_points "
            "scenes_of_relocation scenes_of_verification verification_by_step"
        ),
        _calibration_choice="checked_for_replay choose_calibration choose_probe",
        _climate="ClimateRequest climate_in_use",
        _compile="compile_all compile_group",
        _compose="BuiltStation build_station calibration_of",
        _defaults="DEFAULT_SEED DEFAULT_SOURCE DEMO_PART DEMO_PLAN RECOMMENDED_RIG STANDARD_PROBE",
        _feed_makers="identities script_of segment_of",
        _feeds="Feed StationRequest",
        _from_settings="Errand request_of_settings",
        _kernels="kernel_groups",
        _model_part="part_as_planned part_text",
        _sources=(
            "NamedSource Origin SOURCES SourceSpec make_feed names_in_words origin_of source_help "
            "source_of"
        ),
        _station_checks="measured_checks",
        _station_state="StateLine StationState station_state",
        _stream_options="stream_options",
        _truth="true_values",
    )

__all__ = [
    "DEFAULT_SEED", "DEFAULT_SOURCE", "DEMO_PART", "DEMO_PLAN", "RECOMMENDED_RIG", "SOURCES",
    "STANDARD_PROBE", "VIRTUAL_ROOM", "AcceptanceBench", "AcceptanceSite", "BuiltStation",
    "ClimateRequest", "Conditions", "Errand", "Feed", "NamedSource", "Origin", "SourceSpec",
    "StateLine", "StationRequest", "StationState", "TestsMade", "VirtualSite", "acceptance_feed",
    "artefacts_used_before", "build_station", "calibration_of", "checked_for_replay",
    "choose_calibration", "choose_probe", "climate_in_use", "compile_all", "compile_group",
    "default_test_folder", "identities", "instrument_of", "kernel_groups", "make_feed",
    "measured_checks", "named_artefact", "names_in_words", "open_test_site", "origin_of",
    "part_as_planned", "part_text", "recorded_feed", "relocation_by_step", "request_of_settings",
    "require_recorded", "require_scenes", "scene_of_tip", "scenes_of_acceptance",
    "scenes_of_known_points", "scenes_of_relocation", "scenes_of_verification", "script_of",
    "segment_of", "source_help", "source_of", "station_state", "stream_options", "tests_folder",
    "true_values", "verification_by_step",
]  # fmt: skip
