"""One window: the gates, the position and the stated error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.spot_readings import SpotReading, measure_window
from ocmm_core.camera import NO_BLACK, SpotOptions, SpotStatus
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from tests.core.camera.spot_pictures import LIGHT, picture, spot

# The first one compiles, which takes ten seconds of processor time.
SHAPE = (16, 16)
OPTIONS = SpotOptions(dark_spread=0.0, response_spread=0.0)
"""These pictures have no fixed pattern."""


def look(light: Float, seed: int = 1, options: SpotOptions = OPTIONS) -> SpotReading:
    return measure_window(picture(light, np.random.default_rng(seed)), 100, 200, options)


def gates(make: Callable[[np.random.Generator], Float], count: int = 300) -> dict[str, int]:
    """Return how often each status comes out, over random places between the pixels."""
    found: dict[str, int] = {}
    for seed in range(count):
        rng = np.random.default_rng(seed)
        reading = measure_window(picture(make(rng), rng), 0, 0, OPTIONS)
        found[reading.status.name] = found.get(reading.status.name, 0) + 1
    return found


def centre(rng: np.random.Generator) -> tuple[float, float]:
    u, v = 7.5 + rng.uniform(-0.5, 0.5, 2)
    return float(u), float(v)


def test_a_spot_is_found_where_it_is_in_pixels_of_the_sensor() -> None:
    reading = look(spot(7.3, 6.8, SHAPE, 100_000.0))
    assert reading.status is SpotStatus.GOOD
    # 0.0044 px is its standard deviation; five of them.
    np.testing.assert_allclose(reading.uv, [107.3, 206.8], atol=0.022)
    assert reading.background == pytest.approx(500.0, abs=25.0)
    assert reading.peak == pytest.approx(spot(7.3, 6.8, SHAPE, 100_000.0).max(), rel=0.05)


def test_every_led_of_normal_light_passes() -> None:
    assert gates(lambda rng: spot(*centre(rng), SHAPE), 2000) == {"GOOD": 2000}
    assert gates(lambda rng: spot(*centre(rng), SHAPE, 0.6 * LIGHT), 2000) == {"GOOD": 2000}
    assert gates(lambda rng: spot(*centre(rng), SHAPE, 10.0 * LIGHT), 2000) == {"GOOD": 2000}


def test_an_empty_window_is_dark() -> None:
    found = gates(lambda _rng: np.zeros(SHAPE), 2000)
    assert found["DARK"] == 2000
    assert np.isnan(look(np.zeros(SHAPE)).uv).all()


def test_an_overexposed_spot_says_so() -> None:
    # 16383 - 500 counts in the brightest pixel, which takes 14.7 % of the light at most.
    assert gates(lambda rng: spot(*centre(rng), SHAPE, 90_000.0)) == {"GOOD": 300}
    assert gates(lambda rng: spot(*centre(rng), SHAPE, 200_000.0)) == {"SATURATED": 300}


def test_a_spot_that_is_too_small_is_no_led() -> None:
    hot = np.zeros(SHAPE)
    hot[7, 7], hot[7, 8] = 6000.0, 900.0
    assert look(hot).status is SpotStatus.SMALL


def test_a_spot_that_is_too_large_is_no_led() -> None:
    found = gates(lambda rng: spot(*centre(rng), SHAPE, 40.0 * LIGHT, (2.2, 2.2)))
    # If the brightest pixel reaches the end of the converter, the flag is SATURATED.
    assert set(found) <= {"LARGE", "SATURATED", "EDGE"}
    assert found["LARGE"] > 200


def test_a_spot_whose_place_would_be_too_uncertain_is_dim() -> None:
    light = spot(7.4, 7.6, SHAPE)
    for limit, status in ((0.04, SpotStatus.GOOD), (0.02, SpotStatus.DIM)):
        options = SpotOptions(dark_spread=0.0, response_spread=0.0, max_sigma=limit)
        assert look(light, options=options).status is status


def test_an_elongated_reflection_is_no_led() -> None:
    for sigma in ((2.0, 1.0), (1.0, 2.0), (2.5, 0.8)):

        def streak(rng: np.random.Generator, sigma: tuple[float, float] = sigma) -> Float:
            return spot(*centre(rng), SHAPE, 2.0 * LIGHT, sigma)

        found = gates(streak)
        assert found.get("ELONGATED", 0) >= 297, (sigma, found)


@pytest.mark.parametrize("distance", [2.5, 3.0, 3.5, 4.0])
def test_two_leds_in_one_spot_are_no_led(distance: float) -> None:
    def two(rng: np.random.Generator) -> Float:
        u, v = centre(rng)
        angle = rng.uniform(0.0, np.pi)
        du, dv = 0.5 * distance * np.cos(angle), 0.5 * distance * np.sin(angle)
        return spot(u + du, v + dv, SHAPE) + spot(u - du, v - dv, SHAPE)

    found = gates(two)
    assert found.get("GOOD", 0) == 0, found


def test_two_separate_spots_crowd_a_window() -> None:
    found = gates(lambda rng: spot(*centre(rng), SHAPE) + spot(2.9, 3.2, SHAPE, 0.7 * LIGHT))
    assert found == {"CROWDED": 300}


def test_a_hot_pixel_beside_the_spot_does_not_crowd_the_window() -> None:
    light = spot(7.4, 7.6, SHAPE)
    light[2, 3] = 3000.0
    reading = look(light)
    assert reading.status is SpotStatus.GOOD
    np.testing.assert_allclose(reading.uv, [107.4, 207.6], atol=0.15)


@pytest.mark.parametrize(("u", "v"), [(0.9, 7.5), (14.2, 7.5), (7.5, 1.2), (7.5, 14.0)])
def test_a_spot_at_the_edge_of_its_window_is_refused(u: float, v: float) -> None:
    assert look(spot(u, v, SHAPE)).status is SpotStatus.EDGE


@pytest.mark.parametrize("light", [0.5 * LIGHT, LIGHT, 6.0 * LIGHT])
@pytest.mark.parametrize("sigma", [0.8, 1.0, 1.3])
def test_the_place_between_the_pixels_makes_no_difference(light: float, sigma: float) -> None:
    """Noise-free pictures; the rest comes from threshold, converter and pixels."""
    errors = []
    for u in 7.5 + (np.arange(15) - 7) / 15:
        for v in 7.5 + (np.arange(15) - 7) / 15:
            mean = np.round(500.0 + spot(u, v, SHAPE, light, (sigma, sigma))).astype(np.uint16)
            reading = measure_window(mean, 0, 0, OPTIONS)
            errors.append(reading.uv - [u, v])
    # The centroid that stops at the threshold is off by up to 0.03 px here.
    assert np.abs(errors).max() < 0.003


@pytest.mark.parametrize("light", [0.6 * LIGHT, LIGHT, 6.0 * LIGHT])
def test_the_stated_variance_is_that_of_the_error(
    light: float, record_property: Callable[[str, object], None]
) -> None:
    rng = np.random.default_rng(7)
    errors, variances = [], []
    for _ in range(3000):
        u, v = 7.5 + rng.uniform(-0.5, 0.5, 2)
        reading = measure_window(picture(spot(u, v, SHAPE, light), rng), 0, 0, OPTIONS)
        assert reading.status is SpotStatus.GOOD
        errors.append(reading.uv - [u, v])
        variances.append(reading.variance)
    error, variance = np.array(errors), np.array(variances)
    nees = float(np.mean(error**2 / variance))
    record_property("rms px", f"{np.sqrt(np.mean(error**2)):.4f}")
    record_property("normalised squared error", f"{nees:.3f}")
    # 6000 squares scatter by 1.8 %; the rest is the noise of the variance itself.
    assert nees == pytest.approx(1.0, abs=0.07)
    # The mean of 3000 has 1.8 % of one standard deviation.
    assert np.abs(error.mean(axis=0)).max() < 4.0 * np.sqrt(variance.mean() / 3000.0)


def test_even_light_does_not_move_a_spot() -> None:
    """The ambient light may change after the black image; the border of the window shows it."""
    bare, lit = look(spot(7.2, 7.9, SHAPE), 3), look(spot(7.2, 7.9, SHAPE) + 150.0, 3)
    np.testing.assert_allclose(lit.uv, bare.uv, atol=0.01)
    assert lit.background - bare.background == pytest.approx(150.0, abs=5.0)


def test_the_black_image_is_taken_off_with_its_sign() -> None:
    """A pattern far below and above zero, twice the threshold: gone without a trace."""
    rng = np.random.default_rng(5)
    pattern = np.zeros((300, 300))
    pattern[200:216, 100:116] = rng.uniform(-400.0, 400.0, SHAPE)
    black = np.round(500.0 + pattern).astype(np.uint16)
    errors = []
    for _ in range(400):
        pixels = picture(spot(7.3, 7.6, SHAPE) + pattern[200:216, 100:116].clip(-400, 400), rng)
        errors.append(measure_window(pixels, 100, 200, OPTIONS, black).uv - [107.3, 207.6])
    # 0.03 px for each; photons of the pattern add a little. Four deviations of the mean.
    assert np.abs(np.mean(errors, axis=0)).max() < 0.007
    bare = measure_window(picture(spot(7.3, 7.6, SHAPE), rng), 100, 200, OPTIONS, black)
    assert bare.status is not SpotStatus.GOOD or np.abs(bare.uv - [107.3, 207.6]).max() > 0.1


def test_without_a_black_image_the_stated_variance_holds_the_fixed_pattern() -> None:
    pixels = picture(spot(7.5, 7.5, SHAPE), np.random.default_rng(1))
    options = SpotOptions(response_spread=0.0)
    black = np.full((16, 16), 500, np.uint16)
    stated = [
        measure_window(pixels, 0, 0, options, image).variance.mean() for image in (black, NO_BLACK)
    ]
    # Read noise 40 becomes 72 with the spread of 60; photons take some of the difference.
    assert 2.2 < stated[1] / stated[0] < 3.2


def test_a_larger_window_gives_the_same() -> None:
    for size in (12, 24, 32):
        middle = 0.5 * (size - 1)
        light = spot(middle + 0.3, middle - 0.2, (size, size), 12.0 * LIGHT)
        reading = look(light, options=SpotOptions(window=size))
        assert reading.status is SpotStatus.GOOD
        np.testing.assert_allclose(reading.uv, [100 + middle + 0.3, 200 + middle - 0.2], atol=0.03)


@pytest.mark.parametrize(
    ("field", "value", "sentence"),
    [
        ("threshold", 0.0, "'threshold' of the spot options is 0.0"),
        ("weight_sigma", -1.0, "'weight_sigma' of the spot options is -1.0"),
        ("window", 8, "windows are 8 px wide"),
        ("window", 128, "windows are 128 px wide"),
    ],
)
def test_options_that_cannot_work_are_refused(field: str, value: float, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        SpotOptions(**{field: value})  # type: ignore[arg-type] # any field, by name
