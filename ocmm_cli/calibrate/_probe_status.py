"""``ocmm calibrate probe-status``, ``probe-history`` and ``mount-tip``: the tips of a probe."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console

from ocmm_cli.terminal import heads, lead, make_console, print_grid, say, say_word

if TYPE_CHECKING:
    from ocmm_core.calibration.records import ProbeStore, TipState


def probe_status(*, probe: Path, probes: Path | None) -> None:
    """Say which tip is on the probe, and whether it and the others may be used.

    Exit code 1 where points may not be taken with the mounted tip.
    """
    from ocmm_cli.calibrate._report import evidence_words
    from ocmm_core.calibration.records import State, probe_overview
    from ocmm_core.tracking import load_probe

    console, store = make_console(), _store(probe, probes)
    found = probe_overview(store, datetime.now(UTC))
    _say(console, say(f"Probe    {load_probe(probe).name}, by {probe}"))
    _say(console, f"{lead('Folder   ')}{store.folder}")
    if found.fault:
        _say(console, f"{lead('Records  ')}{say('cannot be used.')} {say(found.fault)}")
        raise typer.Exit(1)
    if not found.tips:
        _say(console, say(f"Tips     none: probe never calibrated ({store.folder})."))
        raise typer.Exit(1)
    for state in found.tips:
        _print_tip(console, state)
        if state.status.state is not State.UNUSABLE:
            _say(console, f"{lead('Evidence ')}{evidence_words(store, state.tip)}")
    mounted = found.tips[0]
    raise typer.Exit(0 if mounted.mounted and mounted.status.state.usable else 1)


def probe_history(*, probe: Path, probes: Path | None) -> None:
    """List what happened to a probe and its tips."""
    rows = []
    for event in _store(probe, probes).events:
        since = say(f" Good until {event.since_utc[:19]}.") if event.since_utc else ""
        lost = say(f" Lost before: {', '.join(event.lost)}.") if event.lost else ""
        rows.append((
            event.utc[:19], event.tip, event.kind.value, event.record[:12], event.who,
            f"{event.reason}{since}{lost}",
        ))  # fmt: skip
    columns = heads("UTC", "Tip", "What", "Record", "Who", "Reason")
    print_grid(make_console(), columns, rows, say_word("History"))


def mount_tip(tip: str, *, probe: Path, probes: Path | None, who: str) -> None:
    """Say that a tip, maybe the same one again, was screwed on; it must be checked.

    No points are taken until 'ocmm calibrate check-tip' has passed.
    """
    store = _store(probe, probes)
    store.mount(tip, who, datetime.now(UTC))
    status = store.status(tip, datetime.now(UTC))
    mounted = say(f"Tip '{tip}' is mounted.")
    _say(make_console(), f"{mounted} {say(status.reason)} {say(status.remedy)}".rstrip())


def _store(probe: Path, folder: Path | None) -> ProbeStore:
    from ocmm_core.calibration.records import ProbeStore, default_probe_folder, probe_store_folder
    from ocmm_core.tracking import load_probe

    place = folder if folder is not None else default_probe_folder()
    return ProbeStore(probe_store_folder(place, load_probe(probe).name))


def _print_tip(console: Console, state: TipState) -> None:
    from ocmm_core.calibration.records import record_hash

    record, qualified, status = state.calibration, state.qualification, state.status
    on = say("mounted") if state.mounted else say("not mounted")
    _say(console, say(f"Tip      {state.tip} ({on})"))
    _say(console, f"{lead('State    ')}{say_word(status.state.value)}")
    if status.reason:
        _say(console, f"         {say(status.reason)} {say(status.remedy)}")
    if status.since_utc:
        _say(console, say(f"         Points since {status.since_utc[:19]} UTC are suspect."))
    _say(
        console,
        say(
            f"Record   {record_hash(record)}\n         calibrated {record.made_utc[:19]} UTC by "
            f"{record.made_by}{_warmth(record.temperature_c)}, valid until "
            f"{record.valid_until_utc[:10]}"
        ),
    )
    if qualified is not None:
        _say(
            console,
            say(
                f"Ball     {qualified.diameter_mm:.4f} mm, U = "
                f"{2e3 * qualified.diameter_sigma_mm:.1f} um (k = 2), form "
                f"{1e3 * qualified.form_mm:.1f} um\n"
                f"         qualified {qualified.made_utc[:19]} UTC by {qualified.made_by}"
                f"{_warmth(qualified.temperature_c)}, valid until {qualified.valid_until_utc[:10]}"
            ),
        )
    if state.check is not None:
        verdict = "passed" if state.check.passed else "FAILED"
        _say(console, say(f"Checked  {state.check.made_utc[:19]} UTC: {verdict}"))


def _warmth(celsius: float | None) -> str:
    return "" if celsius is None else " " + say(f"at {celsius:.1f} C")


def _say(console: Console, text: str) -> None:
    console.print(text, soft_wrap=True)
