"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.composition import source_help

SOURCE_HELP = f"Where frames come from. {source_help()}"

PlanOption = Annotated[Path, typer.Option("--plan", help="Plan document (TOML): what to measure.")]
SourceOption = Annotated[str, typer.Option("--source", help=SOURCE_HELP)]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the job file and the report.")]
RigOption = Annotated[Path, typer.Option("--rig", help="Rig document: the cameras.")]
ProbeOption = Annotated[Path, typer.Option("--probe", help="Probe document: LEDs and tip.")]
PartOption = Annotated[
    Path, typer.Option("--part", help="Part document of the virtual rig: what is truly there.")
]
ReferenceOption = Annotated[
    Path | None,
    typer.Option(
        "--reference",
        help="Reference body document (TOML): LEDs fixed on the part or its table. Everything is "
        "given relative to it, so that a nudged camera frame or a moved table does not matter.",
    ),
]
SeedOption = Annotated[
    int, typer.Option("--seed", min=0, help="Seed of the virtual rig: its noise, its errors.")
]
SpeedOption = Annotated[
    float,
    typer.Option(
        "--speed", min=0.0, help="Speed of virtual rig and replay: 1 is real time, 0 full speed."
    ),
]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Use an interface although the computer uses it itself.")
]
CalibrationsOption = Annotated[
    Path | None,
    typer.Option(
        "--calibrations",
        help="Folder of calibrations. Real cameras use that of this user without it; virtual ones "
        "are measured with the rig document itself.",
    ),
]
UncalibratedOption = Annotated[
    bool,
    typer.Option(
        "--uncalibrated",
        help="Measure although the calibration or the records of the tip are missing or do not "
        "hold: every verdict is NOT PROVEN, and the report says so.",
    ),
]
ProbesOption = Annotated[
    Path | None,
    typer.Option(
        "--probes",
        help="Folder of records of probes. Real cameras use that of this user without it; virtual "
        "ones are measured with the probe document itself.",
    ),
]
TipOption = Annotated[
    str | None,
    typer.Option(
        "--tip",
        help="Name of the tip that is on the probe now. Another one than before is mounted by "
        "this, and must be checked.",
    ),
]
CheckAfterOption = Annotated[
    float,
    typer.Option(
        "--check-after",
        min=0.0,
        help="After so many hours without a point or a check the tip must be checked.",
    ),
]
IncompleteOption = Annotated[
    bool,
    typer.Option(
        "--incomplete",
        help="Write the report also of a job that was not measured completely; its pages and files "
        "say INCOMPLETE.",
    ),
]

ProbeDesignOption = Annotated[
    Path | None,
    typer.Option(
        "--probe-design",
        help="Design document of the probe: its growth and bending enter U, and it can be "
        "compensated for its temperature.",
    ),
]

ProbeTemperatureOption = Annotated[
    float | None, typer.Option("--probe-temperature", help="Of the probe now, °C.")
]

PartTemperatureOption = Annotated[
    float | None, typer.Option("--part-temperature", help="Of the part now, °C.")
]

TemperatureSigmaOption = Annotated[
    float,
    typer.Option("--temperature-sigma", help="Standard uncertainty of each temperature, K."),
]

CompensateProbeOption = Annotated[
    bool,
    typer.Option(
        "--compensate-probe", help="Measure with the probe's geometry at its present temperature."
    ),
]

CompensatePartOption = Annotated[
    bool, typer.Option("--compensate-part", help="Report coordinates as they are at 20 °C.")
]

PartExpansionOption = Annotated[
    float | None,
    typer.Option(
        "--part-expansion", help="Expansion of the part, 1e-6/K; else that of the plan's material."
    ),
]

StreamOption = Annotated[
    int | None,
    typer.Option(
        "--stream",
        min=0,
        max=65535,
        metavar="PORT",
        help="Give points, the button and poses to other programs, as lines of JSON on this TCP "
        "port (0: a free one). Off without it.",
    ),
]

StreamHostOption = Annotated[
    str,
    typer.Option(
        "--stream-host", help="Address of the stream. Beyond this computer it needs a token."
    ),
]

StreamTokenOption = Annotated[
    Path | None,
    typer.Option(
        "--stream-token",
        help="File whose first line is the token that clients of the stream must send.",
    ),
]
