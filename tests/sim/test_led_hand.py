"""A hand led by a user: on the true surfaces, never inside them, no faster than an arm."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tracking import load_probe
from ocmm_sim.hand import HandTarget, MouseHand
from ocmm_sim.hand import _kernel as kernel
from ocmm_sim.hand._led_hand import CLEAR_MM, MOST_LETTERS, NEAREST_MM, TRAVEL_MM_S
from ocmm_sim.hand._solids import solids_of
from ocmm_sim.scene import Part, SimulatedSource, VirtualRig, load_part, sample

_DOWN = np.array([0.0, 0.0, -1.0])
_BLOCK = 8


def _rig(part: str = "demo.toml", hz: int = 800) -> VirtualRig:
    return VirtualRig(
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
        load_part(resource("parts", part)),
        (),
        3,
        frame_rate_hz=hz,
    )


def _part(name: str) -> Part:
    return load_part(resource("parts", name))


class _Led:
    """A hand, and its path."""

    def __init__(self, hz: int = 800) -> None:
        self.rig = _rig(hz=hz)
        self.hand = MouseHand(self.rig)
        self.pose = self.rig.part.T_world_from_part
        self.hand.pick_up(self.pose.apply(np.array([0.0, 0.0, 80.0])), np.zeros(3))
        self.period_s = self.rig.frame_period_ns * 1e-9
        self.frame = 0
        self.tips: list[Float] = []
        self.button: list[bool] = []
        self.contact: list[bool] = []

    def wish(self, place_part: Float, normal_part: Float, clear: float = CLEAR_MM) -> HandTarget:
        origin = self.pose.apply(np.asarray(place_part) + 60.0 * np.asarray(normal_part))
        toward = -(self.pose.rotation @ np.asarray(normal_part))
        return self.hand.wish_at(origin, toward, clear, np.zeros(2))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.period_s / _BLOCK)):
            times = (self.frame + np.arange(_BLOCK, dtype=np.float64)) * self.period_s
            motion = self.hand.motion(times)
            self.frame += _BLOCK
            self.tips += list(self.pose.inverse().apply(motion.tip_world))
            self.button += motion.button.tolist()
            self.contact += motion.in_contact.tolist()


@pytest.mark.parametrize("name", ["demo.toml", "gauge.toml"])
def test_every_place_that_the_robot_touches_is_a_surface_of_a_solid(name: str) -> None:
    part = _part(name)
    solids = solids_of(part)
    assert solids is not None
    radius, normal = 3.0, np.empty(3)
    for entry in part.artefacts:
        contacts = sample(entry, 24, np.random.default_rng(1))
        for point, outward in zip(contacts.points, contacts.normals, strict=True):
            ball = point + radius * outward
            away = kernel.distance(ball, solids.rows, solids.holes, normal)
            # Both are the same geometry: nothing but rounding is between them.
            assert away == pytest.approx(radius, abs=1e-9), entry.name
            assert normal == pytest.approx(outward, abs=1e-6), entry.name


def test_the_ball_never_enters_the_part_however_wildly_it_is_led() -> None:
    led = _Led()
    solids = solids_of(led.rig.part)
    assert solids is not None
    rng = np.random.default_rng(5)
    for _ in range(60):
        place = rng.uniform([-170.0, -70.0, -5.0], [170.0, 70.0, 40.0])
        normal = rng.standard_normal(3)
        wish = led.wish(place, normal / np.linalg.norm(normal), float(rng.uniform(-1.2, 20.0)))
        led.hand.lead(wish)
        led.run(0.15)
    out = np.empty(3)
    gaps = [
        kernel.distance(tip, solids.rows, solids.holes, out) - led.rig.tip_radius
        for tip in np.array(led.tips)
    ]
    # The path over an edge is found step by step; a micrometre is a tenth of the cameras'
    # resolution.
    assert min(gaps) > -1e-3
    speeds = np.linalg.norm(np.diff(led.tips, axis=0), axis=1) / led.period_s
    # Sway adds 0.1 mm at 5 Hz; setting the ball back on a surface moves it along it, no farther.
    assert np.percentile(speeds, 99.0) < 1.1 * TRAVEL_MM_S


@pytest.mark.parametrize(
    ("place", "normal"),
    [
        ((-72.0, 0.0, 20.342), (0.0, 0.0, 1.0)),
        ((-140.0, -9.9945, 50.0), (0.0, -1.0, 0.0)),
        ((155.0, 0.0, 28.0), (0.0, 0.0, 1.0)),
        ((114.0, -14.997, 16.0), (0.0, -1.0, 0.0)),
    ],
)
def test_a_touch_goes_in_rests_presses_once_and_lifts(
    place: tuple[float, float, float], normal: tuple[float, float, float]
) -> None:
    led = _Led()
    assert led.hand.touch(led.wish(np.array(place), np.array(normal)))
    assert not led.hand.touch(led.wish(np.array(place), np.array(normal)))
    led.run(5.0)
    button, tips = np.array(led.button), np.array(led.tips)
    presses = np.flatnonzero(button & ~np.concatenate([[False], button[:-1]]))
    assert len(presses) == 1
    assert all(np.array(led.contact)[button])
    window = tips[presses[0] : presses[0] + round(0.25 / led.period_s)]
    wanted = np.array(place) + led.rig.tip_radius * np.array(normal)
    assert np.ptp(window, axis=0).max() < 1e-9, "held by friction it rests"
    assert np.abs(window - wanted).max() < 0.02, "touched where it was meant"
    assert not led.hand.view().busy
    assert not led.contact[-1]


def test_in_a_bore_it_touches_the_wall_and_gets_out_again() -> None:
    led = _Led()
    bore, radius = np.array([2.0, -17.0, 9.0]), 0.5 * 20.009
    normal = np.array([0.0, 1.0, 0.0])
    wish = led.hand.wish_at(
        led.pose.apply(bore + np.array([0.0, 2.0, 0.0])),
        led.pose.rotation @ -normal,
        CLEAR_MM,
        np.zeros(2),
    )
    assert wish.normal_part == pytest.approx(normal, abs=1e-6)
    assert led.hand.touch(wish)
    led.run(4.0)
    pressed = np.array(led.tips)[np.array(led.button)]
    assert len(pressed)
    away = np.linalg.norm(pressed[:, :2] - bore[:2], axis=1)
    assert away == pytest.approx(radius - led.rig.tip_radius, abs=1e-3)
    # To another bore it goes over the plate, not through it.
    other = led.hand.wish_at(
        led.pose.apply(np.array([62.011, -14.994, 9.0])), led.pose.rotation @ -normal, CLEAR_MM,
        np.zeros(2),
    )  # fmt: skip
    led.hand.lead(other)
    led.run(4.0)
    assert np.linalg.norm(led.tips[-1][:2] - [62.011, -16.994]) < 3.0
    assert led.tips[-1][2] < 15.0


def test_pressed_and_dragged_it_slides_and_pressed_alone_it_stays() -> None:
    led = _Led()
    top = np.array([-72.0, 0.0, 20.342])
    led.hand.lead(led.wish(top, np.array([0.0, 0.0, 1.0]), NEAREST_MM))
    led.run(3.0)
    assert led.hand.view().touches
    before = led.tips[-1]
    led.run(0.5)
    assert led.tips[-1] == pytest.approx(before, abs=1e-12)
    aside = top + np.array([6.0, 0.0, 0.0])
    led.hand.lead(led.wish(aside, np.array([0.0, 0.0, 1.0]), NEAREST_MM))
    led.run(1.0)
    assert led.tips[-1][0] > before[0] + 5.0
    assert led.tips[-1][2] == pytest.approx(before[2], abs=1e-6)


def test_left_alone_it_holds_still_and_led_alike_it_moves_alike() -> None:
    first, second = _Led(), _Led()
    for led in (first, second):
        led.run(0.5)
        sway = np.ptp(np.array(led.tips), axis=0).max()
        assert sway < 1.0, "as far as a hand sways, and no farther"
        led.hand.lead(led.wish(np.array([30.0, 0.0, 15.0]), -_DOWN))
        led.run(1.0)
    assert np.array_equal(first.tips, second.tips)


def test_wishes_from_many_threads_are_bounded_and_the_latest_counts() -> None:
    led = _Led()
    wish = led.wish(np.array([-72.0, 0.0, 20.342]), -_DOWN)

    def flood() -> None:
        for _ in range(500):
            led.hand.lead(wish)

    threads = [threading.Thread(target=flood) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert led.hand.view().forgotten == 2000 - MOST_LETTERS
    led.run(3.0)
    assert led.tips[-1][:2] == pytest.approx([-72.0, 0.0], abs=1.0)


def test_a_part_of_places_only_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "part.toml"
    path.write_text(
        'schema = "ocmm.part/1"\nunit = "mm"\nname = "P"\n[pose]\ntranslation = [0.0, 0.0, 0.0]\n'
        'rotation_vector = [0.0, 0.0, 0.0]\n[[features]]\nkind = "touched"\nname = "A"\n'
        "point = [0.0, 0.0, 0.0]\ndirection = [0.0, 0.0, 1.0]\nplaces = [[0.0, 0.0, 0.0]]\n"
        "normals = [[0.0, 0.0, 1.0]]\nfree = 20.0\n",
        encoding="utf-8",
    )
    rig = _rig()
    rig.part = load_part(path)
    with pytest.raises(InputError, match="single places") as raised:
        MouseHand(rig)
    assert "Demo" in raised.value.remedy


def test_the_source_gives_the_probe_away_and_takes_it_back() -> None:
    rig = _rig()
    rig.extend([("BED", 3)])
    source = SimulatedSource(rig, hover=True)
    source.open()
    for _ in range(250):
        source.read()
    hand = MouseHand(rig)
    source.take_over(hand)
    before = rig.truth.touches
    start, _ = hand.place()
    blocks = [source.read().frames for _ in range(50)]
    assert all(block is not None and len(block) == 8 for block in blocks)
    assert np.linalg.norm(hand.place()[0] - start) < 1e-9, "nobody leads it"
    source.hand_back()
    source.ask = None
    counters = []
    for _ in range(400):
        block = source.read().frames
        assert block is not None
        counters += block.counter.tolist()
    assert np.all(np.diff(counters) == 1)
    assert rig.truth.touches == before
    # Home is above everything.
    tip = rig.motion(counters[-1], 1).tip_world[0]
    assert tip[2] > rig.part.T_world_from_part.apply(np.array([0.0, 0.0, 60.0]))[2]
