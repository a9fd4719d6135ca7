"""The second screen by a client of its protocol: content, languages, rights and limits."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.station.stream import StreamOptions
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_serve.screen import ScreenAccess, ScreenOptions
from ocmm_serve.screen._access import code_lines
from ocmm_serve.screen._server import MOST_READERS
from tests.commands import Ocmm
from tests.host import HANG_S
from tests.serve.ippdme_server import jobs_in, served
from tests.serve.second_screen import SECRET, ServedScreen, read_code, reading, served_screen
from tests.waiting import wait_until

HERE = StreamOptions()


@pytest.fixture
def screen(tmp_path: Path) -> Iterator[ServedScreen]:
    """Return a measured job of the quick plan, with buttons."""
    with served_screen(tmp_path) as served:
        yield served


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedScreen]:
    """Return the same for tests that change nothing: measured once."""
    with served_screen(tmp_path_factory.mktemp("shown")) as served:
        # The first reader starts threads that stay.
        with reading(served, served.access.read_token) as page:
            page.current()
        yield served


def test_shows_values_u_and_verdicts_of_the_core(shown: ServedScreen) -> None:
    with reading(shown, shown.access.read_token) as page:
        job = page.current()
    view = shown.station.job.view()
    assert view.part_verdict.word is PartWord.CONFORMS
    assert job["part"] == {"code": "CONFORM", "text": "PART CONFORMS"}
    assert len(job["results"]) == len(view.characteristics) == 2
    for row, result in zip(job["results"], view.characteristics, strict=True):
        assert row["name"] == result.name
        assert row["verdict"]["code"] == result.verdict.value
        values = (result.measured, result.deviation, result.uncertainty)
        for field, value in zip(("measured", "deviation", "uncertainty"), values, strict=True):
            assert value is not None
            assert float(row[field]) == round(value, 3)
    assert [one["count"] for one in job["features"]] == ["4 / 4", "4 / 4", "6 / 6"]
    assert job["states"] == ["SIMULATED: No real part was measured."]
    assert job["next"] == "All features are measured."


def test_leads_along_a_path(tmp_path: Path) -> None:
    with served_screen(tmp_path, resource("plans", "paths.toml"), measured=False) as served:
        for language, words in (
            ("en", "Press on BED, hold the button and slide 60 mm."),
            ("de", "Auf BED drücken, Taste halten und 60 mm gleiten."),
        ):
            with reading(served, served.access.read_token, language) as page:
                assert page.current()["next"] == words


def test_speaks_german_with_commas(shown: ServedScreen) -> None:
    with reading(shown, shown.access.read_token, "de") as page:
        job = page.current()
        texts = page.latest["texts"] or page.latest
    assert job["part"]["text"] == "WERKSTÜCK KONFORM"
    assert job["next"] == "Alle Elemente sind gemessen."
    assert "," in job["results"][0]["measured"]
    assert "." not in job["results"][0]["measured"]
    assert job["states"] == ["SIMULIERT: Es wurde kein wirkliches Werkstück gemessen."]
    assert texts


def test_every_fixed_text_has_german(shown: ServedScreen) -> None:
    texts = {}
    for language in ("en", "de", "fr"):
        with reading(shown, shown.access.read_token, language) as page:
            texts[language] = page.next()["texts"]
    same = {name for name, text in texts["en"].items() if texts["de"][name] == text}
    assert same == {"uncertainty"}
    assert texts["fr"] == texts["en"]


def test_undo_and_next_change_the_job(screen: ServedScreen) -> None:
    with reading(screen, SECRET) as page:
        page.current()
        assert page.latest["controls"] is True
        assert page.act("undo") == {"id": 1, "what": "", "remedy": ""}
        job = page.current()
        assert job["features"][2]["count"] == "5 / 6"
        assert job["features"][2]["state"]["code"] == "active"
        assert job["next"] == "Touch one more point on SPHERE."
        assert page.act("finish")["what"] == ""
        job = page.current()
    assert job["features"][2] | {"verdict": 0, "note": 0} == {
        "name": "SPHERE", "shape": "Sphere", "count": "5 / 6", "verdict": 0, "note": 0,
        "state": {"code": "done", "text": "done"},
    }  # fmt: skip
    assert screen.station.job.view().complete


def test_takes_a_point_when_the_button_is_pressed(tmp_path: Path) -> None:
    with served_screen(tmp_path, measured=False) as screen, reading(screen, SECRET) as page:
        page.current()
        refused: list[object] = []
        screen.station.events.point_refused.connect(refused.append)
        screen.station.events.point_taken.connect(refused.append)
        assert page.act("take")["what"] == ""
        # The idle hand holds the probe in the air: a point, or a refusal.
        wait_until(lambda: refused)
        job = page.current()
        while not (job["refusal"] or job["features"][0]["count"] != "0 / 4"):
            job = page.current()


def test_refuses_an_action_on_a_job_that_has_changed(screen: ServedScreen) -> None:
    with reading(screen, SECRET) as page:
        page.current()
        assert page.act("undo")["what"] == ""
        # A second press of the same button, before the page shows the first.
        answer = page.act("undo", sequence=page.job["sequence"] - 1)
        assert answer["what"] == "The job has changed since this page showed it."
        page.current()
        assert page.act("finish", job="another")["what"] == answer["what"]
        assert page.act("erase")["what"] == "The page asked for an unknown action."
    assert screen.station.job.view().features[2].taken == 5


def test_shows_errors_of_the_core_in_the_language_of_the_page(screen: ServedScreen) -> None:
    with reading(screen, SECRET, "de") as page:
        page.current()
        while page.current()["undo"]:
            assert page.act("undo")["what"] == ""
        answer = page.act("undo")
    assert answer["what"] == "Noch keine Punkte aufgenommen."


def test_read_only_pages_write_nothing(screen: ServedScreen, repeats: Callable[..., int]) -> None:
    """0 writes of a token for reading, in 10,000 tries."""
    # The job with its log, byte by byte.
    files = sorted(screen.station.job.path.parent.glob(f"{screen.station.job.path.name}*"))
    before = [file.read_bytes() for file in files]
    n, pages = repeats(400, 10_000), 10
    with ExitStack() as stack:
        readers = [
            stack.enter_context(reading(screen, screen.access.read_token)) for _ in range(pages)
        ]
        for page in readers:
            page.current()
            assert page.latest["controls"] is False
        for turn in range(n // pages):
            for page in readers:
                call = {
                    "do": ("take", "undo", "finish")[turn % 3], "id": turn + 1,
                    "job": page.job["job"], "sequence": page.job["sequence"],
                }  # fmt: skip
                page.talk.send(json.dumps(call))
        wait_until(lambda: [page.next() for page in readers] and screen.server.refused >= n)
        for page in readers:
            told = {one["what"] for one in page.answers}
            assert told == {"This page can only read."}
    assert screen.server.refused == n
    assert [file.read_bytes() for file in files] == before


def test_without_control_the_secret_opens_nothing(tmp_path: Path) -> None:
    with served_screen(tmp_path, control=False) as screen:
        for token in (SECRET, "", "x" * 24, screen.access.read_token[:-1]):
            with reading(screen, token) as page, pytest.raises(ConnectionClosed) as closed:
                page.next()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4001
        assert screen.server.refused == 4
        with reading(screen, screen.access.read_token) as page:
            assert page.current()["part"]["code"] == "CONFORM"


def test_the_token_for_reading_does_not_reveal_the_secret() -> None:
    access = ScreenAccess(SECRET, may_control=True)
    assert access.right_of(access.read_token) == "read"
    assert access.right_of(SECRET) == "control"
    assert ScreenAccess(SECRET).right_of(SECRET) == ""
    assert SECRET not in access.read_token
    assert SECRET not in repr(access)
    assert ScreenAccess(SECRET + "2").read_token != access.read_token
    with pytest.raises(InputError, match="15 characters"):
        ScreenAccess("x" * 15)


def test_buttons_in_a_network_need_tls(tmp_path: Path) -> None:
    network = StreamOptions(host="192.0.2.1", allow=("192.0.2.0/24",))
    ScreenOptions(network, ScreenAccess(SECRET))
    with pytest.raises(InputError, match="Without TLS"):
        ScreenOptions(network, ScreenAccess(SECRET, may_control=True))
    made = StreamOptions(
        host="192.0.2.1", allow=("192.0.2.0/24",), certificate=tmp_path, private_key=tmp_path
    )
    options = ScreenOptions(made, ScreenAccess(SECRET, may_control=True))
    assert options.page(1391, "T") == "https://192.0.2.1:1391/#T"


def test_slow_pages_miss_snapshots_and_hold_nothing_up(shown: ServedScreen) -> None:
    with reading(shown, SECRET) as slow, reading(shown, SECRET) as prompt:
        slow.next(acknowledge=False)
        number = prompt.next()["number"]
        before = shown.server.missed
        start = time.monotonic()
        while prompt.next()["number"] < number + 10:
            pass
        assert time.monotonic() - start < 20.0
        assert shown.server.missed >= before + 5
        # Nothing is queued: the snapshot after the acknowledgement is a new one.
        slow.talk.send(json.dumps({"seen": 1}))
        assert slow.next()["number"] == 2


def test_more_pages_than_places_are_turned_away(shown: ServedScreen) -> None:
    token = shown.access.read_token
    with ExitStack() as stack:
        for _ in range(MOST_READERS):
            stack.enter_context(reading(shown, token)).next()
        with reading(shown, token) as page, pytest.raises(ConnectionClosed) as closed:
            page.next()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4029
    wait_until(lambda: shown.server.readers == 0)
    with reading(shown, token) as page:
        page.current()


def test_withdraws_verdicts_of_a_job_that_cannot_be_evaluated(screen: ServedScreen) -> None:
    with reading(screen, screen.access.read_token) as page:
        assert page.current()["part"]["code"] == "CONFORM"
        error = MeasuringError("test.broken", "The evaluation is broken.", "Repair it.")
        screen.station.faults.fail(error, "The evaluation")
        screen.station.events.emit(screen.station.events.changed)
        while page.current()["part"]["code"] == "CONFORM":
            pass
        assert {one["verdict"]["code"] for one in page.job["results"]} == {
            Verdict.NOT_MEASURED.value
        }
        assert not any(one["valued"] for one in page.job["results"])
        assert page.latest["live"]["status"]["code"] == "FAILED"


def test_without_readers_nothing_is_evaluated(screen: ServedScreen) -> None:
    screen.station.events.emit(screen.station.events.changed)
    assert screen.server._job.evaluated is None  # noqa: SLF001 - costs are invisible from outside
    with reading(screen, screen.access.read_token) as page:
        page.current()
    assert screen.server._job.evaluated is not None  # noqa: SLF001 - as above


def test_the_command_prints_addresses_that_work(tmp_path: Path) -> None:
    secret = tmp_path / "token.txt"
    secret.write_text(f"{SECRET}\n")
    secret.chmod(0o600)
    options = ("--plan", str(resource("plans", "quick.toml")), "--token", str(secret), "--control")
    with served(tmp_path, *options, command="screen") as process:
        wait_until(lambda: process.text.count("http://127.0.0.1:") == 2)
        tokens = re.findall(r"http://127\.0\.0\.1:\d+/#(\S+)", process.text)
        assert tokens == [ScreenAccess(SECRET).read_token, SECRET]
        for token, controls in zip(tokens, (False, True), strict=True):
            with connect(f"ws://127.0.0.1:{process.address[1]}/live") as talk:
                talk.send(json.dumps({"token": token}))
                assert json.loads(talk.recv(HANG_S))["controls"] is controls
    # Stopped early, the job is complete or not; without points it is removed.
    assert len(jobs_in(tmp_path)) <= 1


def test_a_secret_that_others_can_read_is_refused(tmp_path: Path, ocmm_here: Ocmm) -> None:
    secret = tmp_path / "token.txt"
    secret.write_text(SECRET)
    secret.chmod(0o644)
    done = ocmm_here("serve", "screen", "--source", "simulated", "--token", secret)
    assert done.returncode == 2
    assert "other users of this computer can read the token" in done.stderr
    assert "chmod 600" in done.stderr
    secret.chmod(0o600)
    secret.write_text("short")
    done = ocmm_here("serve", "screen", "--source", "simulated", "--token", secret)
    assert "The token has 5 characters." in done.stderr


def test_the_code_of_an_address_is_that_address() -> None:
    url = ScreenOptions(HERE, ScreenAccess(SECRET)).page(1391, SECRET)
    lines = code_lines(url)
    rows: list[list[bool]] = []
    for line in lines:
        rows.append([one in " ▄" for one in line])
        rows.append([one in " ▀" for one in line])
    picture = np.repeat(np.repeat(np.where(np.array(rows), 0, 255), 8, axis=0), 8, axis=1)
    assert read_code(picture.astype(np.uint8)) == url
