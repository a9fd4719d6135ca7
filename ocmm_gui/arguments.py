"""Arguments of the window: overrides of settings, and options of this start."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.settings import LoadedSettings, SettingOrigin, Value
from ocmm_core.typed_numbers import option_field
from ocmm_gui.kit import DEFAULT_THEME, THEMES

_GIVEN = {
    "source": "instrument.source",
    "rig": "instrument.rig",
    "probe": "instrument.probe",
    "tip": "instrument.tip",
    "reference": "instrument.reference",
    "calibrations": "instrument.calibrations",
    "probes": "instrument.probes",
    "check_after": "instrument.check_after_h",
    "bus_processor": "instrument.bus_processor",
    "out": "job.folder",
    "part_temperature": "temperature.part_c",
    "part_expansion": "temperature.part_expansion_ppm",
    "compensate_part": "temperature.compensate_part",
    "probe_temperature": "temperature.probe_c",
    "probe_design": "temperature.probe_design",
    "compensate_probe": "temperature.compensate_probe",
    "temperature_sigma": "temperature.sigma_k",
    "temperature_u": "temperature.thermometer",
    "stream": "stream.port",
    "stream_host": "stream.host",
    "stream_token": "stream.token",
    "stream_cert": "stream.certificate",
    "stream_key": "stream.key",
    "theme": "window.theme",
    "far": "window.far",
    "sound": "window.sounds",
}
"""Overridden setting by name of the parsed argument."""


def given(parsed: argparse.Namespace) -> dict[str, Value]:
    """Return the settings given on the command line, by key."""
    return {key: getattr(parsed, name) for name, key in _GIVEN.items() if hasattr(parsed, name)}


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments."""
    made = argparse.ArgumentParser(
        prog="ocmm window",
        description="The OCMM window: measure a part to a plan, with real or virtual cameras. What "
        "is not given here is taken from the settings: ocmm settings show.",
    )
    add = made.add_argument
    add(
        "--start", action="store_true",
        help="without a job: open the Start page instead of measuring at once",
    )  # fmt: skip
    add("job", nargs="?", type=Path, help="job file to look at, read-only")
    add("--plan", type=Path, default=resource("plans", "demo.toml"), help="what to measure")
    add(
        "--part", type=Path, default=resource("parts", "demo.toml"),
        help="the true part, for virtual rigs",
    )  # fmt: skip
    add("--seed", type=_number("--seed"), default=3, help="seed of the virtual rig")
    add(
        "--speed",
        type=_number("--speed"),
        default=1.0,
        help="virtual rig: times real time; 0 is unlimited",
    )
    add("--operator", default="", help="who measures")
    add("--serial", help="serial number of the part; asked in the window for real cameras")
    add(
        "--force",
        action="store_true",
        help="use a network interface although the computer itself uses it",
    )
    add(
        "--uncalibrated",
        action="store_true",
        help="measure without a calibration: every verdict is NOT PROVEN",
    )
    _add_settings(made.add_argument_group("instead of the settings"))
    add("--size", type=_size, help="of the window, e.g. 1280x720; default: maximised")
    add(
        "--quit-after",
        type=_number("--quit-after"),
        default=0.0,
        metavar="SECONDS",
        help="close automatically",
    )
    add(
        "--screenshot", type=_picture, nargs="+", default=[], metavar="FILE",
        help="save a picture of the window when it closes automatically",
    )  # fmt: skip
    return made


def _add_settings(group: argparse._ArgumentGroup) -> None:
    def add(name: str, text: str, **more: object) -> None:
        # Absent if not given, so that the setting holds.
        group.add_argument(name, default=argparse.SUPPRESS, help=text, **more)  # type: ignore[arg-type] # passed on as it is

    add("--source", "source of frames, see 'ocmm measure --help'")
    add("--rig", "the cameras", type=_path)
    add("--probe", "the probe", type=_path)
    add("--tip", "name of the mounted tip")
    add("--reference", "reference body: LEDs fixed on the part or its table", type=_path)
    add("--calibrations", "calibration folder", type=_path)
    add("--probes", "probe record folder", type=_path)
    add(
        "--check-after", "hours without a point or check after which the tip must be checked",
        type=_number("--check-after"), metavar="HOURS",
    )  # fmt: skip
    add(
        "--bus-processor", "processor that the camera bus stays on, 0 first",
        type=_number("--bus-processor"), metavar="N",
    )  # fmt: skip
    add("--out", "folder of jobs and reports", type=_path)
    add("--probe-design", "design document of the probe: growth and bending", type=_path)
    add(
        "--probe-temperature", "of the probe now", type=_number("--probe-temperature"), metavar="°C"
    )
    add(
        "--compensate-probe", "compensate the probe geometry for its temperature",
        action="store_true",
    )  # fmt: skip
    add("--part-temperature", "of the part now", type=_number("--part-temperature"), metavar="°C")
    add(
        "--part-expansion",
        "1e-6/K; default: from the plan",
        type=_number("--part-expansion"),
        metavar="PPM",
    )
    add("--compensate-part", "report coordinates at 20 °C", action="store_true")
    add(
        "--temperature-sigma",
        "of each temperature",
        type=_number("--temperature-sigma"),
        metavar="K",
    )
    add("--temperature-u", "instead: U (k = 2) of the thermometer, K, or its id in the register")
    add(
        "--stream",
        "stream points and poses to other programs",
        type=_number("--stream"),
        metavar="PORT",
    )
    add("--stream-host", "address of the stream; non-local ones need a token")
    add("--stream-token", "file with the token of the stream, readable by you alone", type=_path)
    add("--stream-cert", "certificate (PEM): the stream speaks TLS", type=_path)
    add("--stream-key", "private key of that certificate (PEM, no password)", type=_path)
    add("--theme", "colour theme; T changes it", choices=tuple(THEMES))
    add("--far", "start in the far view; F11 changes it", action="store_true")
    add("--silent", "no sounds", action="store_false", dest="sound")


def _number(option: str) -> Callable[[str], float]:
    """Return the reader of a numeric option, by the table of typed numbers."""
    field = option_field("window", option)
    if field is None:
        raise KeyError(option)

    def read(text: str) -> float:
        try:
            return int(field.read(text)) if field.whole else field.read(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(f"{error.what} {error.remedy}") from error

    return read


def _path(text: str) -> Path:
    return Path(text).expanduser()


def _picture(text: str) -> Path:
    """Return the path of a picture; a job file after the option is refused, not overwritten."""
    if not text.lower().endswith(".png"):
        raise argparse.ArgumentTypeError(f"{text!r} is no picture; give a name ending in .png")
    return Path(text)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height)


@dataclass(frozen=True, slots=True)
class WindowOptions:
    """Options of the window's start and end."""

    theme: str = DEFAULT_THEME
    far: bool = False
    """Start with the far view."""
    size: tuple[int, int] | None = None
    """Width and height, px; None opens it maximised."""
    export: Path | None = None
    """Folder of the report; None asks in the window."""
    quit_after_s: float = 0.0
    """Close after this time; zero stays open."""
    screenshots: tuple[Path, ...] = ()
    """Files for a picture of the window just before it closes."""
    sound: bool = True


def window_options(parsed: argparse.Namespace, loaded: LoadedSettings) -> WindowOptions:
    """Return the options of a start; arguments take precedence over settings."""
    settings = loaded.settings
    told = loaded.origins["job.folder"] is not SettingOrigin.DEFAULT
    return WindowOptions(
        theme=settings.window_theme,
        far=settings.window_far,
        size=parsed.size,
        export=settings.job_folder if told else None,
        quit_after_s=parsed.quit_after,
        screenshots=tuple(parsed.screenshot),
        sound=settings.window_sounds,
    )
