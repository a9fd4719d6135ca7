"""Monte Carlo in a separate process, to keep windows responsive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection

from ocmm_core.blas import use_one_thread
from ocmm_core.errors import MeasuringError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.processes import process_context
from ocmm_core.tolerances.monte_carlo._monte_carlo import (
    MonteCarloOptions,
    MonteCarloReport,
    Tell,
    simulate,
)
from ocmm_core.tolerances.monte_carlo._trials import Task

_LOOK_S = 0.05
_END_S = 1.0


@dataclass(frozen=True, slots=True)
class _Step:
    what: str
    share: float


def simulate_elsewhere(
    task: Task,
    options: MonteCarloOptions,
    tell: Tell = lambda what, share: None,
    given_up: Callable[[], bool] = lambda: False,
) -> MonteCarloReport:
    """Simulate in another process and wait for it; see `monte_carlo.simulate`.

    ``given_up`` is polled 20 times a second and obeyed in two. OcmmError: failed, cancelled, died.
    """
    # The child reads this before it imports numpy; its threads each have their own batches.
    use_one_thread()
    context = process_context()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(
        target=_run, args=(task, options, sender), name="ocmm-monte-carlo", daemon=True
    )
    process.start()
    sender.close()
    try:
        while True:
            if given_up():
                raise MeasuringError(
                    "monte_carlo.given_up",
                    "Simulation cancelled.",
                    "Run it again when you are ready.",
                )
            if not receiver.poll(_LOOK_S):
                continue
            said = receiver.recv()
            if isinstance(said, _Step):
                tell(said.what, said.share)
            elif isinstance(said, OcmmError):
                raise said
            else:
                report: MonteCarloReport = said
                return report
    except EOFError as error:
        raise MeasuringError(
            "monte_carlo.died",
            "The simulation ended unexpectedly; the computer may be out of memory.",
            "Close other programs, or request fewer trials.",
        ) from error
    finally:
        process.terminate()
        process.join(_END_S)
        if process.is_alive():
            process.kill()
            process.join()
        process.close()
        receiver.close()


def _run(task: Task, options: MonteCarloOptions, sender: Connection) -> None:
    """Simulate and send the result; entry point of the process."""
    said: MonteCarloReport | OcmmError
    try:
        said = simulate(task, options, lambda what, share: sender.send(_Step(what, share)))
    except Exception as error:
        said = contained(error, "The simulation")
    sender.send(said)
    sender.close()
