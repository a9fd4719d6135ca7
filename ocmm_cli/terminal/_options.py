from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.composition import source_help

SOURCE_HELP = f"Source of frames. {source_help()}"

PlanOption = Annotated[Path, typer.Option("--plan", help="Plan document (TOML): what to measure.")]
SourceOption = Annotated[str, typer.Option("--source", help=SOURCE_HELP)]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the job file and the report.")]
RigOption = Annotated[Path, typer.Option("--rig", help="Rig document: the cameras.")]
ProbeOption = Annotated[Path, typer.Option("--probe", help="Probe document: LEDs and tip.")]
PartOption = Annotated[
    Path, typer.Option("--part", help="Part document of the virtual rig: the true part.")
]
ReferenceOption = Annotated[
    Path | None,
    typer.Option(
        "--reference",
        help="Reference body document (TOML): LEDs fixed on the part or its table. All results "
        "are relative to it, so a nudged camera frame or a moved table does not matter.",
    ),
]
SeedOption = Annotated[
    int, typer.Option("--seed", help="Seed of the virtual rig: its noise, its errors.")
]
SpeedOption = Annotated[
    float,
    typer.Option("--speed", help="Speed of virtual rig and replay: 1 is real time, 0 full speed."),
]
ForceOption = Annotated[
    bool,
    typer.Option("--force", help="Use a network interface although the computer itself uses it."),
]
BusProcessorOption = Annotated[
    int | None,
    typer.Option(
        "--bus-processor",
        help="Processor that the camera bus stays on, 0 first. Default: the last of four or more.",
    ),
]
CalibrationsOption = Annotated[
    Path | None,
    typer.Option(
        "--calibrations",
        help="Calibration folder. Default: that of this user for real cameras; virtual ones use "
        "the rig document itself.",
    ),
]
UncalibratedOption = Annotated[
    bool,
    typer.Option(
        "--uncalibrated",
        help="Measure although the calibration or tip records are missing or not valid: every "
        "verdict is NOT PROVEN, and the report says so.",
    ),
]
ProbesOption = Annotated[
    Path | None,
    typer.Option(
        "--probes",
        help="Probe record folder. Default: that of this user for real cameras; virtual ones "
        "use the probe document itself.",
    ),
]
TipOption = Annotated[
    str | None,
    typer.Option(
        "--tip",
        help="Name of the mounted tip. A name other than before records a tip change; the tip "
        "must then be checked.",
    ),
]
CheckAfterOption = Annotated[
    float,
    typer.Option(
        "--check-after", help="Hours without a point or check after which the tip must be checked."
    ),
]
IncompleteOption = Annotated[
    bool,
    typer.Option(
        "--incomplete", help="Report an incomplete job too; its pages and files say INCOMPLETE."
    ),
]

ProbeDesignOption = Annotated[
    Path | None,
    typer.Option(
        "--probe-design",
        help="Probe design document: growth and bending enter U, and the probe can be "
        "temperature-compensated.",
    ),
]

ProbeTemperatureOption = Annotated[
    float | None, typer.Option("--probe-temperature", help="Of the probe now, °C.")
]

TemperatureOption = Annotated[
    float | None,
    typer.Option(
        "--temperature",
        help="Ambient temperature, degrees Celsius; default: read the thermometer of "
        "--temperature-u.",
    ),
]
TemperatureUOption = Annotated[
    str,
    typer.Option(
        "--temperature-u",
        help="Its U (k = 2), K, or the id of the thermometer in the register (ocmm artefact).",
    ),
]
RoomOption = Annotated[
    str, typer.Option("--room", help="Temperature of the room, °C: a number or a range.")
]
ThermometerOption = Annotated[
    str,
    typer.Option(
        "--thermometer",
        help="Id of a registered thermometer with a source (several with commas): its readings "
        "are logged in the job.",
    ),
]
HumidityOption = Annotated[str, typer.Option("--humidity", help="Of the air, %.")]
PressureOption = Annotated[str, typer.Option("--pressure", help="Of the air, hPa.")]
PartTemperatureOption = Annotated[
    float | None, typer.Option("--part-temperature", help="Of the part now, °C.")
]

TemperatureSigmaOption = Annotated[
    float | None,
    typer.Option("--temperature-sigma", help="Standard uncertainty of each temperature, K."),
]

CompensateProbeOption = Annotated[
    bool,
    typer.Option("--compensate-probe", help="Compensate the probe geometry for its temperature."),
]

CompensatePartOption = Annotated[
    bool, typer.Option("--compensate-part", help="Report coordinates at 20 °C.")
]

PartExpansionOption = Annotated[
    float | None,
    typer.Option(
        "--part-expansion", help="Expansion of the part, 1e-6/K; default: the plan's material."
    ),
]

StreamOption = Annotated[
    int | None,
    typer.Option(
        "--stream",
        metavar="PORT",
        help="Stream points, button and poses to other programs, as JSON lines on this TCP port "
        "(0: any free port). Default: off.",
    ),
]

StreamHostOption = Annotated[
    str,
    typer.Option("--stream-host", help="Address of the stream. Non-local addresses need a token."),
]

StreamTokenOption = Annotated[
    Path | None,
    typer.Option(
        "--stream-token",
        help="File whose first line is the token required from stream clients; readable by you "
        "alone (chmod 600).",
    ),
]

StreamCertOption = Annotated[
    Path | None, typer.Option("--stream-cert", help="Certificate (PEM): the stream speaks TLS.")
]

StreamKeyOption = Annotated[
    Path | None,
    typer.Option("--stream-key", help="Private key of that certificate (PEM, no password)."),
]
