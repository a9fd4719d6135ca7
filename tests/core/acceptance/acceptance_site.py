"""A machine with known errors, and artefacts, for the engine of acceptance tests."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acceptance import (
    AcceptanceSession,
    InstrumentState,
    PlannedPosition,
    Stage,
    UsedArtefact,
    find_procedure,
    load_procedure,
)
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.geometry import Float

ROOM = Temperature(20.0, 0.3, "")
BEGIN = datetime(2026, 11, 25, 8, 0, tzinfo=UTC)
NESTS = (0.0, 60.0, 140.0, 220.0, 310.0, 400.0)


def room(celsius: float) -> Temperature:
    return replace(ROOM, celsius=celsius)


def artefact(role: str, *sizes: float, **other: object) -> UsedArtefact:
    given: dict[str, object] = {
        "role": role,
        "use": ArtefactUse(
            name=f"virtual {role}",
            serial=f"{role}-1",
            certificate="C-1",
            certificate_sha256="",
            due_utc="2030-01-01T00:00:00+00:00",
        ),
        "sizes": sizes,
        "expanded": 0.001,
        "expansion": 1e-6,
        "expansion_sigma": 0.3e-6,
        "temperatures": (10.0, 35.0),
        "identity": "",
    }
    return UsedArtefact(**{**given, **other})  # type: ignore[arg-type]


ARTEFACTS = (
    artefact("bar", *NESTS),
    artefact("sphere", 30.0, expanded=0.0005, form=0.0003),
    artefact("plate", 20.34),
    artefact("dumbbell", 20.0, 20.0, 200.0),
    artefact("gauge block", 25.0003, expanded=0.0002),
)

INSTRUMENT = InstrumentState(
    rig="recommended", calibration="c" * 64, calibration_status="VALID", probe="standard",
    tip="ball 6", tip_record="t" * 64, ball_radius=3.0, ball_sigma=0.0003,
    cameras=("A", "B", "C"), volume_min=(-200.0, -100.0, -200.0),
    volume_max=(200.0, 100.0, 200.0), software="test", simulated=True,
    stylus=131.6,
)  # fmt: skip


def stage_of(name: str, *, seed: int = 1, **changes: object) -> tuple[Stage, str]:
    procedure, digest = load_procedure(find_procedure(name))
    procedure = msgspec.structs.replace(procedure, **changes)
    return Stage(procedure, INSTRUMENT, ARTEFACTS, seed), digest


def begin(path: Path, name: str, *, seed: int = 1, **changes: object) -> AcceptanceSession:
    stage, digest = stage_of(name, seed=seed, **changes)
    return AcceptanceSession.start(path, stage, digest, BEGIN, temperature=ROOM, who="tester")


@dataclass
class Machine:
    """Returns ball centres as measured by a machine with known errors.

    Attributes
    ----------
    seed, now, celsius
        Seed of the noise, and the readings of clock and thermometer.
    sigma
        Noise of a ball centre per axis, mm.
    scale
        Factor of all lengths.
    per_position
        Additional factor by the name of a position.
    """

    seed: int = 0
    sigma: float = 0.0
    scale: float = 1.0
    per_position: dict[str, float] = field(default_factory=dict)
    now: datetime = BEGIN
    celsius: float = 20.0

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)

    def see(self, position: PlannedPosition, item: int) -> Float:
        point = np.array(position.points_world[item])
        scale = self.per_position.get(position.name, self.scale)
        first = np.array(position.points_world[0])
        # About its first point, so that the artefact stays in its place.
        point = first + scale * (point - first)
        seen: Float = point + self.sigma * self.rng.standard_normal(3)
        return seen

    def step(self, session: AcceptanceSession) -> str:
        view = session.view
        self.now += timedelta(seconds=10)
        if view.needs_temperature:
            session.note_temperature(room(self.celsius), self.now)
        position = view.positions[view.current]
        return session.record_point(self.see(position, view.next_item), self.now)

    def run(self, session: AcceptanceSession) -> None:
        while session.view.current >= 0:
            assert self.step(session) == ""
