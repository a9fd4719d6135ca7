"""Shared by the commands: the console, options, and pictures as files.

In: texts, tables, arrays of pixels, points. Out: text for terminals and pipes, PNG, PGM, SVG.

Read `_console` (printing), `_speech` (language), `_interrupt` (Ctrl-C), `_options` and
`_typed_options` (options of several commands, also of distributed computation), then `_pictures`
(16 bit images) and `_svg` (small plots without a plotting library). It must not know any command.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_cli.terminal._console import (
        PlainConsole,
        make_console,
        print_notes,
        progress_line,
        shown,
        wide_enough,
    )
    from ocmm_cli.terminal._interrupt import DeferredInterrupt
    from ocmm_cli.terminal._options import (
        BusProcessorOption,
        CalibrationsOption,
        CheckAfterOption,
        CompensatePartOption,
        CompensateProbeOption,
        ForceOption,
        HumidityOption,
        IncompleteOption,
        OutOption,
        PartExpansionOption,
        PartOption,
        PartTemperatureOption,
        PlanOption,
        PressureOption,
        ProbeDesignOption,
        ProbeOption,
        ProbesOption,
        ProbeTemperatureOption,
        ReferenceOption,
        RigOption,
        RoomOption,
        SeedOption,
        SourceOption,
        SpeedOption,
        StreamCertOption,
        StreamHostOption,
        StreamKeyOption,
        StreamOption,
        StreamTokenOption,
        TemperatureOption,
        TemperatureSigmaOption,
        TemperatureUOption,
        ThermometerOption,
        TipOption,
        UncalibratedOption,
    )
    from ocmm_cli.terminal._pictures import encoder_for
    from ocmm_cli.terminal._speech import heads, language, lead, say, say_later, say_word, told
    from ocmm_cli.terminal._svg import (
        bending,
        histogram,
        label,
        nice_limit,
        page,
        points_in_space,
        tip_map,
    )
    from ocmm_cli.terminal._typed_options import (
        ColumnsOption,
        DecimalOption,
        SkipOption,
        TableUnitOption,
        computing,
        print_table_account,
        read_typed_numbers,
    )
else:
    __getattr__ = door(
        __name__,
        _console="PlainConsole make_console print_notes progress_line shown wide_enough",
        _interrupt="DeferredInterrupt",
        _options=(
            "BusProcessorOption CalibrationsOption CheckAfterOption CompensatePartOption "
            "CompensateProbeOption ForceOption HumidityOption IncompleteOption OutOption "
            "PartExpansionOption PartOption PartTemperatureOption PlanOption PressureOption "
            "ProbeDesignOption ProbeOption ProbeTemperatureOption ProbesOption ReferenceOption "
            "RigOption RoomOption SeedOption SourceOption SpeedOption StreamCertOption "
            "StreamHostOption StreamKeyOption StreamOption StreamTokenOption TemperatureOption "
            "TemperatureSigmaOption TemperatureUOption ThermometerOption TipOption "
            "UncalibratedOption"
        ),
        _pictures="encoder_for",
        _speech="heads language lead say say_later say_word told",
        _svg="bending histogram label nice_limit page points_in_space tip_map",
        _typed_options=(
            "ColumnsOption DecimalOption SkipOption TableUnitOption computing "
            "print_table_account read_typed_numbers"
        ),
    )

__all__ = [
    "BusProcessorOption", "CalibrationsOption", "CheckAfterOption", "ColumnsOption",
    "CompensatePartOption", "CompensateProbeOption", "DecimalOption",
    "DeferredInterrupt", "ForceOption",
    "HumidityOption", "IncompleteOption", "OutOption", "PartExpansionOption", "PartOption",
    "PartTemperatureOption", "PlainConsole", "PlanOption", "PressureOption", "ProbeDesignOption",
    "ProbeOption", "ProbeTemperatureOption", "ProbesOption", "ReferenceOption", "RigOption",
    "RoomOption", "SeedOption", "SkipOption", "SourceOption", "SpeedOption", "StreamCertOption",
    "StreamHostOption", "StreamKeyOption", "StreamOption", "StreamTokenOption", "TableUnitOption",
    "TemperatureOption", "TemperatureSigmaOption", "TemperatureUOption", "ThermometerOption",
    "TipOption", "UncalibratedOption", "bending", "computing", "encoder_for", "heads",
    "histogram", "label", "language", "lead", "make_console", "nice_limit", "page",
    "points_in_space", "print_notes", "print_table_account", "progress_line",
    "read_typed_numbers", "say", "say_later", "say_word", "shown", "tip_map", "told", "wide_enough",
]  # fmt: skip
