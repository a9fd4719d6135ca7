"""Record raw frames, say how fast this machine is, and compile what it computes most."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.cli.terminal import (
    ForceOption,
    PartOption,
    PlanOption,
    ProbeOption,
    ReferenceOption,
    RigOption,
    SeedOption,
    SourceOption,
    SpeedOption,
    make_console,
    say,
)
from ocmm_core.composition import (
    DEFAULT_SEED,
    DEFAULT_SOURCE,
    DEMO_PART,
    DEMO_PLAN,
    RECOMMENDED_RIG,
    STANDARD_PROBE,
)


def record(
    *,
    out: Annotated[Path, typer.Option("--out", help="File for the recording.")],
    source: SourceOption = DEFAULT_SOURCE,
    plan: PlanOption = DEMO_PLAN,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    reference: ReferenceOption = None,
    part: PartOption = DEMO_PART,
    seed: SeedOption = DEFAULT_SEED,
    speed: SpeedOption = 0.0,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--seconds", min=0.1, help="Stop after this much bus time; default: at the end."
        ),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Record the raw frames of a source, to be measured later with --source replay:FILE.

    The recording is safe against a crash at any moment: what is whole up to then can be replayed.
    Stop a live source with --seconds or Ctrl-C.
    """
    from ocmm_core.cli.measure import record_source
    from ocmm_core.composition import StationRequest

    request = StationRequest(
        plan=plan, out=out.parent, rig=rig, probe=probe, part=part, source=source, seed=seed,
        speed=speed, force=force, reference=reference,
    )  # fmt: skip
    record_source(request, out, seconds, make_console())


def bench(
    *,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.2, help="Duration of each measurement.")
    ] = 2.0,
    memory: Annotated[
        float,
        typer.Option(
            "--memory", min=0.0, help="Also run the whole chain for this many minutes of bus time."
        ),
    ] = 0.0,
) -> None:
    """Print the speed of the hot path on this machine, as ratios against limits and a peer.

    With --memory 60 the whole chain runs for an hour of bus time at full speed (some minutes on
    the clock), and its memory is printed ten times.
    """
    from ocmm_core.cli.study import print_run, run_bench, run_for

    console = make_console()
    run_bench(seconds, console)
    if memory > 0.0:
        print_run(run_for(60.0 * memory, console), 60.0 * memory, console)


def compile_command(
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="Default: one a core.")
    ] = None,
) -> None:
    """Compile what is computed most, so that nobody waits for it later; the set-up does it.

    What is there already is not compiled again. Another processor needs it anew.
    """
    from ocmm_core.composition import compile_all

    done = compile_all(processes)
    typer.echo(
        say(f"{done.listed} compiled functions are ready, {done.compiled} were compiled now.")
    )
