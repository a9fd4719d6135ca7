"""Separation of drift, jump and earlier change, and the interval back to the last good check."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from ocmm_core.calibration.monitor import camera_changes
from ocmm_core.calibration.records import VerificationRecord
from tests.core.calibration.test_verification_session import Session
from tests.host import amount

Course = Literal["drift", "jump", "before"]
_RESTS = 71
_EXPECTED = {
    "drift": ("session.drift", "drifted evenly"),
    "jump": ("session.camera_moved", "moved by about"),
    "before": ("session.before", "during the whole session (focal length"),
}


def changed(session: Session, course: Course, seed: int) -> tuple[VerificationRecord, str, int]:
    """Return the record of a session with a known change, the camera, and its first rest."""
    rng = np.random.default_rng([seed, 17])
    number, sign = int(rng.integers(2)), float(rng.choice([-1.0, 1.0]))
    moment = int(rng.integers(10, 40))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    full = np.zeros(9)
    if course == "before":
        full[6] = sign * rng.uniform(0.02, 0.05)
    else:
        full[:2] = rng.uniform(120e-6, 200e-6) * np.array([np.cos(angle), np.sin(angle)])
    exact = session.spots.cameras

    def before(rest: int) -> None:
        share = {"drift": rest / _RESTS, "jump": float(rest >= moment), "before": 1.0}[course]
        camera = exact[number].perturbed(camera_changes(exact[number]) @ (share * full))
        session.spots.cameras = tuple(camera if c == number else one for c, one in enumerate(exact))

    record = session.take(before)
    return record, session.rig.cameras[number].name, moment


@pytest.mark.parametrize("course", ["drift", "jump", "before"])
def test_course_of_change_is_named(tmp_path: Path, course: Course) -> None:
    code, words = _EXPECTED[course]
    # N seeds each; every true cause must be named first.
    for seed in range(amount(4, 10)):
        session = Session(tmp_path / str(seed))
        start = session.end + timedelta(hours=1)
        record, name, moment = changed(session, course, seed)
        assert not record.passed
        named = [one for one in record.objections if one.code.startswith("session.")]
        assert named[0].code == code, (seed, [one.what for one in named])
        assert f"'{name}'" in named[0].what
        assert words in named[0].what
        assert len(named) == 1, (seed, [one.what for one in named])
        assert record.arose is not None
        assert not record.arose.verified
        assert record.arose.good_utc == session.record.made_utc
        first = start + timedelta(seconds=15)
        seen = datetime.fromisoformat(record.arose.seen_utc)
        if course == "before":
            assert seen == first
        elif course == "jump":
            assert seen >= first + timedelta(seconds=15 * moment)


def loosened(session: Session, course: Course, seed: int) -> tuple[VerificationRecord, int]:
    """Return the record of a session in which an LED moves by 60 to 120 um, and the LED."""
    rng = np.random.default_rng([seed, 29])
    led, moment = int(rng.integers(session.bench.body.n_leds)), int(rng.integers(10, 40))
    way = rng.standard_normal(3)
    way *= rng.uniform(0.06, 0.12) / float(np.linalg.norm(way))
    world = session.spots.world

    def before(rest: int) -> None:
        leds = world.leds_probe.copy()
        leds[led] += way * (rest / _RESTS if course == "drift" else float(rest >= moment))
        session.spots.world = replace(world, leds_probe=leds)

    return session.take(before), led


@pytest.mark.parametrize("course", ["drift", "jump"])
def test_a_loose_led_is_named(tmp_path: Path, course: Course) -> None:
    """No camera is blamed, in N seeds each."""
    for seed in range(amount(2, 5)):
        record, led = loosened(Session(tmp_path / str(seed)), course, seed)
        assert not record.passed
        named = [one for one in record.objections if one.code.startswith("session.")]
        assert [one.code for one in named] == ["session.probe_moved"], [one.what for one in named]
        assert f"LED {led + 1} of the probe" in named[0].what
        assert ("drifted evenly" if course == "drift" else "moved by about") in named[0].what


def test_interval_and_recall_start_at_last_observation_of_good_check(tmp_path: Path) -> None:
    """Jobs measured between the last good observation and its acceptance are recalled."""
    session = Session(tmp_path)
    good = session.take()
    accepted = session.end + timedelta(hours=3)
    session.procedure.accept(accepted, "verified late")
    session.end = accepted
    session.procedure = session.begin()
    record, _, _ = changed(session, "before", 1)
    assert record.arose is not None
    assert record.arose.verified
    made = datetime.fromisoformat(good.made_utc)
    assert datetime.fromisoformat(record.arose.good_utc) == made
    assert record.arose.sentence.startswith("The error arose between 2026-03-02 ")
    session.procedure.accept(session.end, "failed")
    since = session.bench.store().status(session.end).since_utc
    assert datetime.fromisoformat(since) == made
