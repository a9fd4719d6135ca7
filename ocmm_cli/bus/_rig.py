"""``ocmm rig``: software cameras on named network interfaces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import make_console, say

if TYPE_CHECKING:
    from ocmm_sim.bus import RigStatus


rig_app = typer.Typer(
    no_args_is_help=True,
    help="Software cameras on named interfaces, for a second program.\n\n'up' creates a pair of "
    "virtual network interfaces (ocmm0 and ocmm1); the cameras of the virtual rig answer "
    "on one as EtherCAT slaves, and a master (ocmm measure --source ethercat:ocmm0 or any "
    "other) uses the other. Needs root; touches only interfaces it created.",
)


@rig_app.command()
def up(*, plan: Path, rig: Path, probe: Path, part: Path, seed: int) -> None:
    """Make the interfaces and start the software cameras; the script begins with operation."""
    from ocmm_core.camera import load_rig
    from ocmm_core.composition import StationRequest
    from ocmm_core.inspection.plan import load_plan
    from ocmm_sim.bus import rig_up
    from ocmm_sim.sources import segment_of

    request = StationRequest(plan=plan, out=Path(), rig=rig, probe=probe, part=part, seed=seed)
    _print(rig_up(segment_of(request, load_plan(plan), load_rig(rig))))


@rig_app.command()
def down() -> None:
    """Stop the software cameras and remove the interfaces that 'up' made."""
    from ocmm_sim.bus import rig_down

    removed = rig_down()
    if removed is None:
        make_console().print(say("No virtual rig on named interfaces."))
    else:
        make_console().print(say(f"Removed {removed.host}, {removed.cameras} and their cameras."))


@rig_app.command()
def status() -> None:
    """Say what 'up' made and what of it runs."""
    from ocmm_sim.bus import rig_status

    _print(rig_status())


def _print(state: RigStatus) -> None:
    console = make_console()
    record = state.record
    if record is None:
        console.print(say("No virtual rig on named interfaces. Create one: ocmm rig up"))
        return
    console.print(
        say(f"Master's side   {record.host}: {'there' if state.interface_there else 'gone'}")
    )
    running = say(f"running, process {record.pid}") if state.cameras_running else say("not running")
    console.print(say(f"Cameras         {', '.join(record.names)} on {record.cameras}: {running}"))
    console.print(
        say(f"Measure         ocmm measure --source ethercat:{record.host} --plan ... --out ...")
    )
