"""Composition root: build sources, calibrations and a station from requests.

In: a plan, a source name, temperatures and options from a command or the window.
Out: a prepared source, its calibration, and a station ready to start.

Start with `_compose`. `_sources` has one entry per frame source, of this package and of others that
register theirs (`ocmm.sources`); `_feed_makers` and `_feeds` (also requests from the settings of
the window) make our own, `_calibration_choice` selects the records of a source and returns their
status; `_climate` and `_defaults` do what their names say. `_acceptance_site` and
`_acceptance_bench` build acceptance tests for commands and the window, `hands` shows their frames.
It must not import the virtual rig, nor commands.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.composition._acceptance_bench import (
        VIRTUAL_ROOM, AcceptanceBench, StatedConditions, TestsMade, start_test,
    )  # fmt: skip
    from ocmm_core.composition._acceptance_site import (
        AcceptanceSite, default_test_folder, earlier_use, open_test_site, recorded_feed,
        require_recorded, require_scenes, tests_folder,
    )  # fmt: skip
    from ocmm_core.composition._calibration_choice import (
        StateLine, StationState, checked_for_replay, choose_calibration, choose_probe,
        station_state,
    )  # fmt: skip
    from ocmm_core.composition._climate import ClimateRequest, climate_in_use
    from ocmm_core.composition._compose import BuiltStation, build_station, calibration_of
    from ocmm_core.composition._defaults import (
        DEFAULT_SOURCE, DEMO_PART, DEMO_PLAN, IN_PROCESS, RECOMMENDED_RIG, SERVICE, STANDARD_PROBE,
        VIRTUAL_WIRE,
    )  # fmt: skip
    from ocmm_core.composition._feed_makers import (
        bus_config, bus_description, described_cameras, identities, rate_of,
    )  # fmt: skip
    from ocmm_core.composition._feeds import (
        Errand, Feed, Remaining, ScriptedOperator, ScriptedRig, StationRequest, request_of_settings,
        stream_options,
    )  # fmt: skip
    from ocmm_core.composition._sources import (
        NamedSource, Origin, SourceSpec, late, make_feed, names_in_words, origin_of, source_help,
        source_of, sources, virtual_names,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "DEFAULT_SOURCE", "DEMO_PART", "DEMO_PLAN", "IN_PROCESS", "RECOMMENDED_RIG", "SERVICE",
    "STANDARD_PROBE", "VIRTUAL_ROOM", "VIRTUAL_WIRE", "AcceptanceBench", "AcceptanceSite",
    "BuiltStation", "ClimateRequest", "Errand", "Feed", "NamedSource", "Origin", "Remaining",
    "ScriptedOperator", "ScriptedRig", "SourceSpec", "StateLine", "StatedConditions",
    "StationRequest", "StationState", "TestsMade", "build_station", "bus_config", "bus_description",
    "calibration_of", "checked_for_replay", "choose_calibration", "choose_probe", "climate_in_use",
    "default_test_folder", "described_cameras", "earlier_use", "identities", "late", "make_feed",
    "names_in_words", "open_test_site", "origin_of", "rate_of", "recorded_feed",
    "request_of_settings", "require_recorded", "require_scenes", "source_help", "source_of",
    "sources", "start_test", "station_state", "stream_options", "tests_folder", "virtual_names",
]  # fmt: skip
