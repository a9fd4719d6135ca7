"""Probe design: bending, thermal growth, and tip accuracy of the LED layout.

In: a document of sections, materials and LEDs; temperatures, weight and force; a rig.
Out: displacements of LEDs and tip, least possible tip uncertainty, possible LED confusions.

Read `_design` (the document), `_definition` (definition of a new probe), `_beam` (bending and
growth), `_shape` (both together, and the computed tip), then `_layout` (accuracy with a rig). It
imports no other package of calibration, and is independent of records and procedures.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.probe_design._beam import (
        HIGHEST_C, LARGEST_U_K, LOWEST_C, REFERENCE_C, UNMEASURED_K, Bar, MaterialExpansion, Panel,
        Temperature, certified_at, compression, require_temperature, sag, side_load,
        stated_temperature, upright_shortening,
    )  # fmt: skip
    from ocmm_core.calibration.probe_design._definition import (
        DefinitionCheck, definition_of, examine, probe_text, read_definition, save_definition,
    )  # fmt: skip
    from ocmm_core.calibration.probe_design._design import (
        ProbeDesign, leds_behind_body, load_design, shipped_design,
    )  # fmt: skip
    from ocmm_core.calibration.probe_design._layout import (
        Postures, TipMap, TipNumber, View, WrongLabels, tilt_map, tip_number, volume_map,
        wrong_labels,
    )  # fmt: skip
    from ocmm_core.calibration.probe_design._shape import (
        ContactForce, TemperatureState, body_in_use, bow_shape, check_temperature, contact_force,
        force_shapes, growth_shape, sag_shape, tip_shift,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "HIGHEST_C", "LARGEST_U_K", "LOWEST_C", "REFERENCE_C", "UNMEASURED_K", "Bar", "ContactForce",
    "DefinitionCheck", "MaterialExpansion", "Panel", "Postures", "ProbeDesign", "Temperature",
    "TemperatureState", "TipMap", "TipNumber", "View", "WrongLabels", "body_in_use", "bow_shape",
    "certified_at", "check_temperature", "compression", "contact_force", "definition_of", "examine",
    "force_shapes", "growth_shape", "leds_behind_body", "load_design", "probe_text",
    "read_definition", "require_temperature", "sag", "sag_shape", "save_definition",
    "shipped_design", "side_load", "stated_temperature", "tilt_map", "tip_number", "tip_shift",
    "upright_shortening", "volume_map", "wrong_labels",
]  # fmt: skip
