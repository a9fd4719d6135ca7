"""The page of the second screen in a real Chromium, at the sizes of phones and tablets."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from ocmm_core.errors import MeasuringError
from ocmm_core.inspection.evaluation import FeatureState, HoldReason, JobView
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from tests.host import HANG_MS, long_form, needs_package, not_run
from tests.serve.second_screen import SECRET, ServedScreen, served_screen

if TYPE_CHECKING:
    # Loaded by the tests that have found it.
    from playwright.sync_api import Browser, Page

SIZES = {
    "small phone": (360, 640), "phone": (390, 844), "tablet upright": (820, 1180),
    "tablet": (1180, 820),
}  # fmt: skip
GLOVE_PX = 60
"""Least height of a button: 16 mm on a tablet of 96 px an inch."""
GONE_S = 1.0
PLAN = """
schema = "ocmm.plan/1"
unit = "mm"
name = "MIXED"
part = "DEMO_PART"

[[features]]
name = "BED"
shape = "Plane"
points = 4
point = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]

[[features]]
name = "BLOCK_TOP"
shape = "Plane"
points = 4
point = [-72.0, 0.0, 20.34]
direction = [0.0, 0.0, 1.0]

[[features]]
name = "SPHERE"
shape = "Sphere"
points = 6
point = [-140.0, 0.0, 50.0]
direction = [0.0, 0.0, 1.0]
diameter = 19.989
side = "outer"
"""
CHARACTERISTIC = """
[[characteristics]]
name = "{name}"
kind = "{kind}"
features = {features}
nominal = {nominal}
lower = {lower}
upper = {upper}
"""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """Return a running Chromium; each test opens pages of its own."""
    needs_package("playwright", "pip install playwright")
    found = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    if found is None:
        not_run("Chromium is not installed (Debian: apt-get install chromium-headless-shell)")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


@contextlib.contextmanager
def opened(
    chromium: Browser,
    url: str,
    *,
    size: tuple[int, int] = SIZES["tablet"],
    language: str = "en",
    dark: bool = False,
) -> Iterator[Page]:
    """Open a page and wait for its first snapshot; errors in its console fail the test."""
    context = chromium.new_context(
        viewport={"width": size[0], "height": size[1]}, locale=language,
        color_scheme="dark" if dark else "light",
    )  # fmt: skip
    context.set_default_timeout(HANG_MS)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    page.wait_for_selector("#gone", state="hidden")
    page.wait_for_selector("body[data-sequence]")
    try:
        yield page
    finally:
        context.close()
    assert errors == []


def mixed_plan_in(folder: Path) -> Path:
    """Return a plan whose results are CONFORM, NOT CONFORM and NOT PROVEN."""
    step = {"kind": "distance", "features": '["BLOCK_TOP", "BED"]'}
    ball = {"kind": "diameter", "features": '["SPHERE"]'}
    rows = [
        step | {"name": "Step", "nominal": 20.34, "lower": -0.08, "upper": 0.08},
        step | {"name": "Wrong step", "nominal": 20.34, "lower": 0.06, "upper": 0.08},
        ball | {"name": "Ball", "nominal": 19.989, "lower": -0.2, "upper": 0.2},
        ball | {"name": "Tight ball", "nominal": 19.989, "lower": -0.02, "upper": 0.02},
        {"name": "Flatness", "kind": "flatness", "features": '["BED"]', "nominal": 0.0,
         "lower": 0.0, "upper": 0.1},
    ]  # fmt: skip
    text = PLAN + "".join(CHARACTERISTIC.format(**row) for row in rows)
    file = folder / "mixed.toml"
    file.write_text(text, "utf-8")
    return file


def shown_on(page: Page, screen: ServedScreen, view: JobView) -> dict[str, object]:
    """Return the words and colours of a page once it shows a state of the job."""
    sequence = screen.server._job.changes  # noqa: SLF001 - the page shows no number of its state
    page.wait_for_selector(f"body[data-sequence='{sequence}']")
    assert screen.station.job.view() is view
    found: dict[str, object] = page.evaluate(
        """() => {
          const word = (one) => [one.dataset.code, one.textContent];
          const rows = (id) => [...document.querySelectorAll(`#${id} > li`)].map((row) =>
            [row.querySelector("b").textContent, ...word(row.querySelector(".word"))]);
          const numbers = [...document.querySelectorAll("#list > li")].map((row) =>
            [...row.querySelectorAll("dd")].slice(0, -1).map((one) => one.textContent));
          return {results: rows("list"), features: rows("features"), numbers,
            verdict: word(document.getElementById("verdict"))};
        }"""
    )
    return found


def expected_of(view: JobView) -> dict[str, object]:
    """Return the expected contents of a page."""
    features = []
    for one in view.features:
        summary = view.verdict_of(one.name)
        code, text = one.state.value, {"pending": "open"}.get(one.state.value, one.state.value)
        if one.state is FeatureState.DONE and summary.verdict is not None:
            code = summary.verdict.value
            text = summary.share or code
        elif one.state is FeatureState.DONE:
            code, text = "", "NO TOLERANCE"
        features.append([one.name, code, text])
    part = view.part_verdict
    verdict = ["" if part.verdict is None else part.verdict.value, part.word.value]
    if not view.shows_part and view.shown is not None:
        summary = view.verdict_of(view.shown.name)
        code = "" if summary.verdict is None else summary.verdict.value
        verdict = [code, summary.share or code or "NO TOLERANCE"]
    return {
        "results": [[one.name, *[one.verdict.value] * 2] for one in view.characteristics],
        "features": features,
        "numbers": [_numbers(one) for one in view.characteristics],
        "verdict": verdict,
    }  # fmt: skip


def _numbers(result: CharacteristicResult) -> list[str]:
    """Return value, deviation and U as the page must show them; none without a value."""
    if result.measured is None or result.deviation is None or result.uncertainty is None:
        return []
    values = (result.measured, result.deviation, result.uncertainty)
    return [
        f"{round(value, 3) + 0.0:{sign}.3f}"
        for value, sign in zip(values, ("", "+", ""), strict=True)
    ]


def test_verdicts_on_the_page_are_those_of_the_core(
    chromium: Browser, tmp_path: Path, repeats: Callable[..., int]
) -> None:
    """Random walks of an inspector: N of 1,000, eight steps each."""
    n = repeats(12, 1000)
    seen: set[Verdict] = set()
    with served_screen(tmp_path, mixed_plan_in(tmp_path)) as screen:
        job = screen.station.job
        names = [one.name for one in job.plan.features]
        with opened(chromium, screen.page(screen.access.read_token)) as page:
            for walk in range(n):
                rng = np.random.default_rng(walk)
                for _ in range(8):
                    _step(screen, rng, names)
                    view = job.view()
                    assert shown_on(page, screen, view) == expected_of(view), walk
                    seen |= {one.verdict for one in view.characteristics}
    assert seen == set(Verdict)


def _step(screen: ServedScreen, rng: np.random.Generator, names: list[str]) -> None:
    """Do one random action of an inspector, which the job may refuse."""
    name, number = str(rng.choice(names)), int(rng.integers(1, 15))
    verbs: list[Callable[[InspectionSession], object]] = [
        lambda session: session.steps.finish(),
        lambda session: session.steps.skip(name),
        lambda session: session.steps.reopen(name),
        lambda session: session.steps.undo(),
        lambda session: session.steps.redo(),
        lambda session: session.steps.select(name),
        lambda session: session.points.delete_point(number, "a chip"),
        lambda session: session.points.restore_point(number),
        lambda session: session.held.hold_back_points([number], "Why.", HoldReason.CAMERAS),
        lambda session: session.held.release("All is well."),
    ]
    verb = verbs[int(rng.integers(len(verbs)))]
    with contextlib.suppress(MeasuringError):
        screen.station.job.change(verb)


# Widths depend on the language and contrasts on the colours: two of four show both.
_LOOKS = [("en", False), ("de", True), *([("en", True), ("de", False)] if long_form() else [])]


@pytest.mark.parametrize(("language", "dark"), _LOOKS)
def test_fits_phones_and_tablets(
    chromium: Browser, tmp_path: Path, language: str, dark: bool
) -> None:
    """Nothing is wider than the screen or cut off, buttons suit gloves, axe-core has no fault."""
    needs_package("axe_playwright_python", "pip install axe-playwright-python")
    from axe_playwright_python.sync_playwright import Axe

    with served_screen(tmp_path, mixed_plan_in(tmp_path)) as screen:
        for size in SIZES.values():
            with opened(
                chromium, screen.page(SECRET), size=size, language=language, dark=dark
            ) as page:
                for tab in ("far", "plan", "results"):
                    page.click(f"#tab-{tab}")
                    faults = page.evaluate(
                        """(least) => {
                          const cut = (one) => one.scrollWidth > one.clientWidth + 1;
                          const wide = [...document.querySelectorAll("body *")].filter((one) =>
                            one.getClientRects().length && (cut(one)
                              || one.getBoundingClientRect().right > innerWidth + 1));
                          const small = [...document.querySelectorAll("button")].filter((one) =>
                            one.getClientRects().length && one.offsetHeight < least);
                          return [...wide, ...small].map((one) => one.outerHTML.slice(0, 120));
                        }""",
                        GLOVE_PX,
                    )
                    assert faults == [], (size, tab)
                    found = Axe().run(page).response["violations"]
                    grave = [one for one in found if one["impact"] in ("serious", "critical")]
                    assert grave == [], (size, tab)


def test_shows_within_a_second_that_the_station_is_gone(chromium: Browser, tmp_path: Path) -> None:
    stack = contextlib.ExitStack()
    screen = stack.enter_context(served_screen(tmp_path))
    with stack, opened(chromium, screen.page(SECRET), language="de") as page:
        page.evaluate(
            """() => { window.shown = new Promise((done) => {
              const gone = document.getElementById("gone"), cut = performance.now();
              new MutationObserver(() => gone.hidden || done(performance.now() - cut))
                .observe(gone, {attributes: true});
            }); }"""
        )
        # The connection stays open without data, as with a computer that hangs.
        loop = screen.server._loop  # noqa: SLF001 - to make it hang
        assert loop is not None
        loop.call_soon_threadsafe(time.sleep, 3.0)
        waited_ms = page.evaluate("() => window.shown")
        assert waited_ms <= 1000.0 * GONE_S
        assert page.inner_text("#gone p") == "Keine Verbindung zur Station."
        # The page reconnects.
        page.wait_for_selector("#gone", state="hidden")
        stack.close()
        page.wait_for_selector("#gone", state="visible")


def test_buttons_change_the_job_once(chromium: Browser, tmp_path: Path) -> None:
    with served_screen(tmp_path) as screen:
        with opened(chromium, screen.page(SECRET)) as page:
            # Pressed twice within the time of one answer.
            page.evaluate("() => { const one = document.getElementById('undo'); one.click(); }")
            page.evaluate("() => document.getElementById('undo').click()")
            page.wait_for_selector("#features :text('5 / 6')", state="attached")
            assert screen.station.job.view().features[2].taken == 5
            page.click("#finish")
            page.wait_for_selector("#far.part")
            assert screen.station.job.view().complete
        with opened(chromium, screen.page(screen.access.read_token)) as page:
            assert not page.is_visible("#buttons")


def test_shows_names_as_text_and_refusals_with_their_remedy(
    chromium: Browser, tmp_path: Path
) -> None:
    plan = mixed_plan_in(tmp_path)
    hostile = "<img src=x onerror=document.title=1>"
    plan.write_text(
        plan.read_text("utf-8").replace('name = "BED"\n', f'name = "BED"\ntext = "{hostile}"\n'),
        "utf-8",
    )
    with served_screen(tmp_path, plan) as screen:
        screen.station.job.change(lambda session: session.steps.reopen("BED"))
        with opened(chromium, screen.page(SECRET)) as page:
            page.wait_for_selector(f"#instruction:text-is('{hostile}')")
            assert page.title() == "OCMM"
            screen.station.job.change(lambda session: session.pausing.pause())
            page.click("#take")
            page.wait_for_selector("#notes .bad b")
            refusal = screen.station.job.view().refusal
            assert refusal is not None
            assert page.inner_text("#notes .bad") == f"{refusal.what} {refusal.remedy}"
        page = chromium.new_page()
        page.goto(screen.page("of-another-start"))
        page.wait_for_selector("#gone :text('Scan')")
        assert page.is_visible("#gone")
        assert page.text_content("#list") == ""
        page.context.close()
