from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.documents import resource

VIRTUAL_BAR = resource("artefacts", "bar.toml")
VERIFICATION_BAR = resource("artefacts", "verification_bar.toml")
"""Not the calibration bar: verification needs a length that did not set the scale."""

FolderOption = Annotated[
    Path | None,
    typer.Option("--calibrations", help="Calibration folder; default: that of this user."),
]
WhoOption = Annotated[str, typer.Option("--who", help="Name for the record.")]
DecisionOption = Annotated[
    bool | None,
    typer.Option(
        "--accept/--keep",
        help="Accept the result, or keep the active one; if neither is given, a terminal asks "
        "and a script leaves the session waiting.",
    ),
]
NewOption = Annotated[
    bool, typer.Option("--new", help="Start a new session although one can be resumed.")
]
MoveOption = Annotated[
    int | None, typer.Option("--move", help="Virtual rig: move its frame randomly with this seed.")
]
OverruleOption = Annotated[
    str, typer.Option("--overrule", help="Reason for overriding the data-quality guards; recorded.")
]
CheckBarOption = Annotated[
    Path,
    typer.Option("--bar", help="Length bar document; not the bar used to calibrate the cameras."),
]
BarOption = Annotated[Path, typer.Option("--bar", help="Document of the length bar.")]
ShotsOption = Annotated[
    Path | None, typer.Option("--shots", help="Recorded averaged spots instead of a source.")
]
SpotColumnsOption = Annotated[
    str,
    typer.Option("--spot-columns", help="Columns of the recorded spots, such as point,serial,u,v."),
]
SpotDecimalOption = Annotated[
    str, typer.Option("--spot-decimal", help="Decimal sign of the recorded spots: point or comma.")
]
SpotSkipOption = Annotated[
    str, typer.Option("--spot-skip", help="Lines of recorded spots that are not read: 3 or 4-9.")
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
"""One minute of waving samples the pattern of a 400 mm volume to a sixth (`benchmarks/bump.py`)."""
