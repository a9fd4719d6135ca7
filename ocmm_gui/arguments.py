"""Arguments of the window: overrides of settings, and options of this start."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ocmm_core.errors import InputError
from ocmm_core.options import WINDOW, Option
from ocmm_core.settings import Kind, LoadedSettings, SettingOrigin, Value
from ocmm_core.typed_numbers import number_field
from ocmm_gui.kit import DEFAULT_THEME


def given(parsed: argparse.Namespace) -> dict[str, Value]:
    """Return the settings given on the command line, by key."""
    return {name: value for name, value in vars(parsed).items() if "." in name}


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments, made from the table of options."""
    made = argparse.ArgumentParser(
        prog="ocmm window",
        description="The OCMM window: measure a part to a plan, with real or virtual cameras. What "
        "is not given here is taken from the settings: ocmm settings show.",
    )
    group = made.add_argument_group("instead of the settings")
    for option in WINDOW:
        # A setting that is not given is absent, so that its documents hold.
        default = argparse.SUPPRESS if option.setting else option.default
        (group if option.setting else made).add_argument(
            *((option.name,) if option.is_argument else option.typed),
            default=default, help=option.text, **_reader(option),
        )  # fmt: skip
    return made


def _reader(option: Option) -> dict[str, Any]:
    """Return how argparse reads the value of an option."""
    spec = option.spec if option.setting else None
    target = {} if option.is_argument else {"dest": option.setting or option.name}
    if isinstance(option.default, bool):
        return {**target, "action": f"store_{str(not option.default).lower()}"}
    if spec is not None and spec.kind is Kind.CHOICE:
        return {**target, "choices": spec.choices}
    read: dict[str, Any] = {"metavar": option.metavar or option.name.upper()}
    if option.is_argument:
        read["nargs"] = "?"
    if option.number:
        read |= {"type": _number(option), "metavar": option.metavar or _unit(option)}
    elif isinstance(option.default, tuple):
        read |= {"type": _picture, "nargs": "+"}
    elif option.name == "size":
        read["type"] = _size
    elif option.is_argument or isinstance(option.default, Path) or (spec and spec.kind in _PATHS):
        read["type"] = _path
    return {**target, **read}


_PATHS = (Kind.FILE, Kind.FOLDER)


def _unit(option: Option) -> str | None:
    field = option.field
    return (field.quantity.unit or "N").replace("%", "%%") if field is not None else None


def _number(option: Option) -> Callable[[str], float]:
    """Return the reader of a numeric option, by the table of typed numbers."""
    field = number_field(option.number)

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
