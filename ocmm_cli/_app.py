"""Commands of ``ocmm`` and their options, with record, bench and compile."""

from __future__ import annotations

import os
from collections import UserDict
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperGroup

from ocmm_cli import calibrate, measure, study
from ocmm_cli.acceptance import acceptance_app, artefact_app, msa_app
from ocmm_cli.archive import archive_app
from ocmm_cli.bus import bus_app, camera_app, rig_app
from ocmm_cli.options import describe, described, read_typed_numbers
from ocmm_cli.station import audit_app, key_app, settings_app, station_app, support_app
from ocmm_cli.terminal import make_console, tr
from ocmm_core.build import build_version
from ocmm_core.plugins import load
from ocmm_core.plugins import names as plugin_names


def record(
    *, out: Path, source: str, plan: Path, rig: Path, probe: Path, reference: Path | None,
    part: Path, seed: int, speed: float, seconds: float | None, force: bool,
) -> None:  # fmt: skip
    """Record the raw frames of a source, to be measured later with --source replay:FILE.

    The recording survives a crash at any moment: all complete frames can be replayed.
    Stop a live source with --seconds or Ctrl-C.
    """
    from ocmm_core.composition import StationRequest

    request = StationRequest(
        plan=plan, out=out.parent, rig=rig, probe=probe, part=part, source=source, seed=seed,
        speed=speed, force=force, reference=reference,
    )  # fmt: skip
    measure.record_source(request, out, seconds, make_console())


def bench(*, seconds: float, memory: float) -> None:
    """Print the speed of the hot path on this machine, as ratios against limits and a peer.

    With --memory 60 the whole chain runs for an hour of bus time at full speed (some minutes on
    the clock), and its memory is printed ten times.
    """
    from ocmm_cli.study import print_run, run_bench, run_for

    console = make_console()
    run_bench(seconds, console)
    if memory > 0.0:
        print_run(run_for(60.0 * memory, console), 60.0 * memory, console)


def compile_command(processes: int | None) -> None:
    """Compile the most used functions in advance, as the set-up does.

    Functions in the compiled cache are not compiled again. Each type of processor needs its own.
    """
    from ocmm_cli import compile_all

    done = compile_all(processes)
    typer.echo(
        tr(f"{done.listed} compiled functions are ready, {done.compiled} were compiled now.")
    )


def window(context: typer.Context) -> None:
    """Open the window and measure at once; `ocmm window --help` lists the options.

    Settings (`ocmm settings show`) apply unless an option is given.
    """
    measure.open_window(*context.args)


calibrate.calibrate_app.command()(calibrate.write_cameras)
calibrate.calibrate_app.command()(calibrate.tracker)
calibrate.calibrate_app.command()(calibrate.scale)
calibrate.calibrate_app.command(name="probe")(calibrate.probe_command)
calibrate.calibrate_app.command(name="tip")(calibrate.tip_command)
calibrate.calibrate_app.command(name="check-tip")(calibrate.check_tip_command)
archive_app.command(name="recall")(measure.recall_archived)
for command in (calibrate.mount_tip, calibrate.probe_status, calibrate.probe_history):
    calibrate.calibrate_app.command()(command)

_COMMANDS: dict[str, typer.Typer | Callable[..., None]] = {
    "align": measure.align_command,
    "align-plan": measure.align_plan_command,
    "compare": measure.compare_command,
    "environment": measure.environment_command,
    "uncertainty": study.uncertainty_command,
    "report": measure.report_command,
    "recall": measure.recall_command,
    "fit": study.fit_command,
    "verify-fits": study.verify_fits_command,
    "window": window,
    "demo": measure.demo,
    "measure": measure.measure,
    "record": record,
    "bench": bench,
    "compile": compile_command,
    "rig": rig_app,
    "bus": bus_app,
    "camera": camera_app,
    "calibrate": calibrate.calibrate_app,
    "study": study.study_app,
    "probe": study.probe_app,
    "plan": measure.plan_app,
    "archive": archive_app,
    "audit": audit_app,
    "key": key_app,
    "certificate": measure.certificate_app,
    "station": station_app,
    "settings": settings_app,
    "support": support_app,
    "acceptance": acceptance_app,
    "artefact": artefact_app,
    "msa": msa_app,
}
_SETTINGS: dict[str, dict[str, Any]] = {
    "window": {
        "add_help_option": False,
        "context_settings": {"allow_extra_args": True, "ignore_unknown_options": True},
    },
    "compile": {"hidden": True},
}


GROUP = "ocmm.commands"
"""Entry points of commands that packages add, each a function or an application of typer; a name
with a point, such as `camera.conform`, is a command of that group."""


class _Commands(UserDict[str, Any]):
    """Commands by name, each built when it is looked up: building all takes 0.3 s."""

    def __getitem__(self, name: str) -> Any:
        if self.data[name] is None:
            self.data[name] = _build(name)
        return self.data[name]


def _build(name: str) -> Any:
    parent = typer.Typer(add_completion=False)
    found = _COMMANDS.get(name) or load(GROUP, name, object)
    if isinstance(found, typer.Typer):
        for added in plugin_names(GROUP):
            group, point, own = added.partition(".")
            if point and group == name and callable(more := load(GROUP, added, object)):
                found.command(name=own)(more)
        parent.add_typer(found, name=name)
    elif callable(found):
        parent.command(name=name, **_SETTINGS.get(name, {}))(found)
    describe(parent)
    built = typer.main.get_command(parent)
    command = getattr(built, "commands", {}).get(name, built)
    read_typed_numbers(command, name)
    return command


_BUILT = _Commands(
    dict.fromkeys([*_COMMANDS, *(one for one in plugin_names(GROUP) if "." not in one)])
)


class _Root(TyperGroup):
    """The command ``ocmm``; builds only the command that is called."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _BUILT

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names without building their commands."""
        del ctx
        return list(self.commands)


Language = Literal["en", "de"]
app = typer.Typer(
    name="ocmm",
    cls=_Root,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    help="Measure parts with an optical coordinate measuring machine.\n\nCameras track the LEDs "
    "of a hand-held probe; OCMM computes the position of its ball, fits features to the "
    "probed points and evaluates their tolerances.\n\nWithout a command, the window opens with its "
    "Start page; without a display, this help is printed.\n\nExit codes: 0 every "
    "characteristic conforms, 1 one does not or is not proven to, 2 not or not completely "
    "measured, 3 program failure: the message names the cause and a log file.",
    epilog="To try it: ocmm demo. The rig, probe, part and plan documents in the resources "
    "folder are templates for your own.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ocmm {build_version()}")
        raise typer.Exit


def _options(
    context: typer.Context,
    *,
    version: Annotated[bool, typer.Option(callback=_version, is_eager=True)],
    language: Language | None,
) -> None:
    del version
    if language is not None:
        # Child windows and reports use it also.
        os.environ["OCMM_LANGUAGE"] = language
    if context.invoked_subcommand is not None:
        return
    if measure.has_display():
        measure.open_window("--start")
    typer.echo(context.get_help())


app.callback()(described(_options, "ocmm"))
