"""Options that the commands of ``ocmm calibrate`` share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.documents import resource

VIRTUAL_BAR = resource("artefacts", "bar.toml")
VERIFICATION_BAR = resource("artefacts", "verification_bar.toml")
"""Another one: a verification needs a length that did not give the calibration its scale."""

FolderOption = Annotated[
    Path | None,
    typer.Option("--calibrations", help="Folder of calibrations; without it that of this user."),
]
WhoOption = Annotated[str, typer.Option("--who", help="Who does it; goes into the record.")]
TemperatureOption = Annotated[
    float | None, typer.Option("--temperature", help="Of the surroundings, degrees Celsius.")
]
DecisionOption = Annotated[
    bool | None,
    typer.Option(
        "--accept/--keep",
        help="Accept the result, or keep what is in force; without either, a terminal asks, and a "
        "script leaves the session waiting.",
    ),
]
NewOption = Annotated[
    bool, typer.Option("--new", help="Begin a new session although one can go on.")
]
MoveOption = Annotated[
    int | None,
    typer.Option("--move", help="Virtual rig: its frame was moved, drawn with this seed."),
]
OverruleOption = Annotated[
    str,
    typer.Option(
        "--overrule", help="Why guards about how the data were taken are overruled; recorded."
    ),
]
CheckBarOption = Annotated[
    Path,
    typer.Option(
        "--bar",
        help="Document of the length bar; not the one that the cameras were calibrated with.",
    ),
]
BarOption = Annotated[Path, typer.Option("--bar", help="Document of the length bar.")]
ShotsOption = Annotated[
    Path | None, typer.Option("--shots", help="Recorded averaged spots instead of a source.")
]
RecordOption = Annotated[
    Path | None,
    typer.Option("--record", help="Keep all raw frames in this file; --source replay:FILE."),
]
ProbeRecordsOption = Annotated[
    Path | None,
    typer.Option(
        "--probes",
        help="Folder of records of probes. Without it that of this user for real cameras, and one "
        "apart from it for virtual ones.",
    ),
]
AnyCamerasOption = Annotated[
    bool, typer.Option("--uncalibrated", help="Use cameras without a usable calibration.")
]

WAVE_S = 60.0
"""A minute of waving holds the pattern of a volume of 400 mm to a sixth (`benchmarks/bump.py`)."""
