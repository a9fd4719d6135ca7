"""True cameras, probe and ball, as opposed to their documents.

Documents hold the best estimate and its covariance. Each virtual world draws its truth from that
covariance, so that stated uncertainties can be compared with known errors. A sensor has a fixed
pattern of spot errors that depend on the position, equal in all frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import DTypeLike, NDArray

from ocmm_core.camera import N_PARAMETERS, USUAL_SLOTS, CameraModel, Rig, SpotNoise
from ocmm_core.geometry import Float, Int, RigidTransform, rotation_from_vector
from ocmm_core.tracking import ProbeBody, ReferenceBody

_WAVES = 256
_FEW = 32
_NODES_PER_LENGTH = 5.0
"""Bilinear interpolation between nodes at a fifth of the length takes 1 % off the variance."""


@dataclass(frozen=True, slots=True)
class SpotPattern:
    """A smooth random field on the sensor, one per image axis."""

    nodes: Float
    """(2, rows, columns), px: error in u and in v at the nodes."""
    step_px: float
    """Distance of the nodes; the first lies at pixel (0, 0)."""


def draw_pattern(
    noise: SpotNoise, width: int, height: int, rng: np.random.Generator
) -> SpotPattern:
    """Return a Gaussian field with standard deviation and correlation of `noise`.

    The correlation at distance d is ``exp(-d^2 / (2 l^2))``. The field is a sum of cosine waves
    with normally distributed wave vectors (random Fourier features, Rahimi and Recht 2007); the
    addition theorem turns each wave into products of a row and a column.
    """
    step = noise.pattern_length_px / _NODES_PER_LENGTH
    columns, rows = int(width / step) + 2, int(height / step) + 2
    nodes = np.empty((2, rows, columns))
    for axis in range(2):
        wave = rng.standard_normal((2, _WAVES)) / noise.pattern_length_px
        cos_u, sin_u = _waves(columns, step * wave[0], rng.uniform(0.0, 2.0 * np.pi, _WAVES))
        cos_v, sin_v = _waves(rows, step * wave[1], np.zeros(_WAVES))
        nodes[axis] = cos_v @ cos_u.T - sin_v @ sin_u.T
    nodes *= noise.pattern_px * np.sqrt(2.0 / _WAVES)
    return SpotPattern(nodes, step)


def _waves(count: int, turn: Float, phase: Float) -> tuple[Float, Float]:
    """Return cosine and sine (count, w) of ``n turn + phase``, both (w,), rad.

    Addition theorem on every `_FEW`-th value and the first ones: these dominate the cost.
    """
    far = _FEW * np.arange(-(-count // _FEW))[:, None, None] * turn + phase
    near = np.arange(_FEW)[:, None] * turn
    cos_far, sin_far, cos_near, sin_near = np.cos(far), np.sin(far), np.cos(near), np.sin(near)
    cosine = (cos_far * cos_near - sin_far * sin_near).reshape(-1, len(turn))[:count]
    return cosine, (sin_far * cos_near + cos_far * sin_near).reshape(-1, len(turn))[:count]


def no_pattern(width: int, height: int) -> SpotPattern:
    """Return the pattern of a perfect sensor."""
    return SpotPattern(np.zeros((2, 2, 2)), float(max(width, height)))


CHUNK_FRAMES = 80
"""Frames whose white noise shares one key."""

_CAMERAS, _PROBE, _PATTERN, _SLOTS, _WHITE, _OCCLUSION, _REFERENCE = range(7)
_OCCLUSION_CELL_S = 1.0
_OCCLUSION_MIN_S, _OCCLUSION_MAX_S = 0.050, 0.300


@dataclass(frozen=True, slots=True)
class ScriptedOcclusion:
    """LEDs hidden from a camera during a range of frames."""

    camera: int
    """Index of the camera; -1 for all."""
    leds: tuple[int, ...]
    first_frame: int
    last_frame: int


@dataclass(frozen=True, slots=True)
class ScriptedBump:
    """A permanent displacement of a camera."""

    camera: int
    first_frame: int
    """First frame from the new pose."""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """rad, about its own axes (right, down, along the view) through its projection centre."""
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """mm, of that centre along these axes."""


@dataclass(frozen=True, slots=True)
class ScriptedNudge:
    """A common motion of part, reference body and operator against the camera frame.

    A moved table or pushed camera frame, indistinguishable; it adds to earlier nudges.
    """

    first_frame: int
    frames: int = 0
    """`first_frame`, `frames`: start and duration; 0 frames for a jump."""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """rad, about the axes of the world through its origin."""
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """Simulated imperfections."""

    camera_error: bool = True
    probe_error: bool = True
    tip_error: bool = True
    """`camera_error`, `probe_error`, `tip_error`: true cameras, LED and tip positions, and ball
    radius differ from the documents."""
    white_noise: bool = True
    pattern_noise: bool = True
    """`white_noise`, `pattern_noise`: spots scatter between frames, and over the sensor."""
    occlusion_rate_hz: float = 0.0
    """Mean number of occlusions per second of each LED and camera, of 50 to 300 ms each."""
    occlusions: tuple[ScriptedOcclusion, ...] = ()
    bumps: tuple[ScriptedBump, ...] = ()
    nudges: tuple[ScriptedNudge, ...] = ()
    drops: tuple[int, ...] = ()
    """Frames at which the probe is dropped and caught: it senses a shock, nothing else changes."""

    @classmethod
    def ideal(cls) -> WorldOptions:
        """Return a world with true documents and without scatter; for tests."""
        return cls(
            camera_error=False,
            probe_error=False,
            tip_error=False,
            white_noise=False,
            pattern_noise=False,
        )


@dataclass(frozen=True, slots=True)
class World:
    """True cameras and probe."""

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    """`leds_probe`: (L, 3), mm, probe frame; `tip_probe`: (3,), mm, probe frame."""
    tip_radius: float
    """mm."""
    n_slots: int
    """Slots per camera: the number of LEDs, `USUAL_SLOTS` at least."""
    slots: Int
    """(C, L) int64: slot of each LED in each camera."""
    patterns: tuple[SpotPattern, ...]
    leds_reference: Float
    """(R, 3), mm, reference frame; (0, 3) without a reference body."""
    reference_slots: Int
    """(C, R) int64: slot of each LED of the reference body in each camera."""

    def packed(self, camera: int, model: CameraModel) -> Float:
        """Return a camera at its pose in ``model`` with its sensor, (24,), for `kernels.see`."""
        sensor = (model.width, model.height, self.patterns[camera].step_px)
        return np.concatenate([model.packed(), sensor])


def draw_world(
    rig: Rig,
    body: ProbeBody,
    seed: int,
    options: WorldOptions,
    reference: ReferenceBody | None = None,
) -> World:
    """Return the world of a seed: truth drawn from the documents' covariances."""
    cameras = rig.cameras
    if options.camera_error:
        change = _draw(rig.parameter_covariance, _generator(seed, _CAMERAS))
        change = change.reshape(len(cameras), N_PARAMETERS)
        cameras = tuple(camera.perturbed(row) for camera, row in zip(cameras, change, strict=True))
    rng = _generator(seed, _PROBE)
    radius_error = body.tip_radius_sigma * rng.standard_normal()
    geometry = np.concatenate([body.leds_probe.ravel(), body.tip_probe])
    if options.probe_error:
        geometry = geometry + _draw(body.geometry_covariance, rng)
    sizes = tuple((camera.width, camera.height) for camera in cameras)
    patterns = (
        _patterns(rig.noise, sizes, seed)
        if options.pattern_noise
        else tuple(no_pattern(*size) for size in sizes)
    )
    leds_reference = np.zeros((0, 3))
    if reference is not None:
        leds_reference = reference.leds.leds_body
        if options.probe_error:
            error = _draw(reference.geometry_covariance, _generator(seed, _REFERENCE))
            leds_reference = leds_reference + error.reshape(-1, 3)
    rng = _generator(seed, _SLOTS)
    n_leds = body.n_leds + len(leds_reference)
    n_slots = max(USUAL_SLOTS, n_leds)
    slots = np.stack([rng.permutation(n_slots)[:n_leds] for _ in cameras]).astype(np.int64)
    return World(
        cameras=cameras,
        leds_probe=geometry[:-3].reshape(-1, 3),
        tip_probe=geometry[-3:],
        tip_radius=body.tip_radius + (radius_error if options.tip_error else 0.0),
        n_slots=n_slots,
        slots=slots[:, : body.n_leds],
        patterns=patterns,
        leds_reference=leds_reference,
        reference_slots=slots[:, body.n_leds :],
    )


@lru_cache(maxsize=2)
def _patterns(
    noise: SpotNoise, sizes: tuple[tuple[int, int], ...], seed: int
) -> tuple[SpotPattern, ...]:
    """Return the read-only patterns of cameras of these sizes.

    Drawing them dominates the cost of a world, and one rig is rebuilt for each job and procedure:
    the last ones are cached, 10 MB each. Write flags would be another type for the kernel.
    """
    rng = _generator(seed, _PATTERN)
    return tuple(draw_pattern(noise, width, height, rng) for width, height in sizes)


def bumped(camera: CameraModel, bump: ScriptedBump) -> CameraModel:
    turn = rotation_from_vector(-np.array(bump.turn))
    pose = camera.T_camera_from_world
    moved = RigidTransform(turn @ pose.rotation, turn @ (pose.translation - np.array(bump.shift)))
    return replace(camera, T_camera_from_world=moved)


def nudged(nudges: Sequence[ScriptedNudge], frames: Int) -> tuple[Float, Float]:
    """Return the scene motion (n, 3, 3) and (n, 3), mm, in the frames (n,)."""
    rotation = np.broadcast_to(np.eye(3), (len(frames), 3, 3)).copy()
    shift = np.zeros((len(frames), 3))
    for nudge in nudges:
        way = np.clip((frames - nudge.first_frame + 1) / max(nudge.frames, 1), 0.0, 1.0)
        # Minimum jerk, as a table starts and stops.
        way = way**3 * (10.0 + way * (6.0 * way - 15.0))
        for value in np.unique(way[way > 0.0]):
            there = way == value
            turn = rotation_from_vector(value * np.array(nudge.turn))
            rotation[there] = turn @ rotation[there]
            shift[there] = shift[there] @ turn.T + value * np.array(nudge.shift)
    return rotation, shift


def white_noise(
    seed: int, camera: int, n_leds: int, first: int, count: int, *, beside: bool = False
) -> Float:
    """Return standard normal numbers (count, n_leds, 2) for the frames from `first`.

    Every chunk of frames has its own key (counter-based generator Philox, Salmon et al. 2011), so a
    frame has the same numbers in any grouping. The LEDs of a second body (``beside``) have other
    keys, so that the probe's noise does not depend on it.
    """
    # Cameras beyond four were added later; the first four keep their numbers.
    item = camera + (4 if beside else 0) if camera < 4 else camera + (128 if beside else 64)
    chunks = range(first // CHUNK_FRAMES, (first + count - 1) // CHUNK_FRAMES + 1)
    numbers = [_white_chunk(seed, item, chunk, n_leds) for chunk in chunks]
    start = first - chunks[0] * CHUNK_FRAMES
    joined = numbers[0] if len(numbers) == 1 else np.concatenate(numbers)
    return joined[start : start + count]


@lru_cache(maxsize=32)
def _white_chunk(seed: int, item: int, chunk: int, n_leds: int) -> Float:
    """Return the numbers (CHUNK_FRAMES, n_leds, 2) of one key; read-only.

    A slow rig requests few frames at a time, so each chunk often. The cache holds the chunks of two
    bodies and a dozen cameras, 10 kB each.
    """
    numbers = _keyed(seed, _WHITE, item, chunk).standard_normal((CHUNK_FRAMES, n_leds, 2))
    numbers.setflags(write=False)
    return numbers


def hidden_leds(
    options: WorldOptions, seed: int, camera: int, n_leds: int, first: int, times_s: Float
) -> NDArray[np.uint64]:
    """Return the hidden LEDs of a camera: (n,) uint64, bit l for LED l.

    ``first`` is the first frame, ``times_s`` (n,) the times of consecutive frames.
    """
    hidden = np.zeros(len(times_s), dtype=np.uint64)
    frames = first + np.arange(len(times_s))
    for event in options.occlusions:
        if event.camera in (-1, camera):
            bits = sum(1 << led for led in event.leds)
            hidden[(frames >= event.first_frame) & (frames <= event.last_frame)] |= np.uint64(bits)
    if options.occlusion_rate_hz > 0.0 and len(times_s):
        # An event of the previous cell may extend into the first cell.
        cells = (times_s[[0, -1]] / _OCCLUSION_CELL_S).astype(int)
        for cell in range(cells[0] - 1, cells[1] + 1):
            for led in range(n_leds):
                rng = _keyed(seed, _OCCLUSION, _led_item(camera, led), cell + 1)
                events = rng.poisson(options.occlusion_rate_hz * _OCCLUSION_CELL_S)
                begin = (cell + rng.random(events)) * _OCCLUSION_CELL_S
                end = begin + rng.uniform(_OCCLUSION_MIN_S, _OCCLUSION_MAX_S, events)
                for start, stop in zip(begin, end, strict=True):
                    hidden[(times_s >= start) & (times_s < stop)] |= np.uint64(1 << led)
    return hidden


def _led_item(camera: int, led: int) -> int:
    # LEDs beyond eight were added later; the first eight keep their events.
    return 8 * camera + led if led < 8 else 128 + 64 * camera + led


def _generator(seed: int, stream: int) -> np.random.Generator:
    return np.random.default_rng([seed, stream])


class _Key(ISeedSequence):
    """The key of a Philox generator.

    ``Philox(key=...)`` gives the same numbers but first reads unused random bytes from the system:
    110 of its 145 us, for each chunk of each camera.
    """

    def __init__(self, key: NDArray[np.uint64]) -> None:
        self._key = key

    def generate_state(self, n_words: int, dtype: DTypeLike = np.uint64) -> NDArray[np.uint64]:
        """Return the key: Philox requests two words of 64 bits."""
        return self._key


def _keyed(seed: int, stream: int, item: int, block: int) -> np.random.Generator:
    key = np.array([seed, (stream << 56) | (item << 40) | block], dtype=np.uint64)
    # numpy accepts any ISeedSequence; its stub only its own.
    return np.random.Generator(np.random.Philox(_Key(key)))  # type: ignore[arg-type]


def _draw(covariance: Float, rng: np.random.Generator) -> Float:
    """Return a normal vector of a covariance whose units differ widely."""
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    normal = rng.standard_normal(len(scale))
    drawn: Float = scale * (vectors @ (np.sqrt(np.maximum(values, 0.0)) * normal))
    return drawn
