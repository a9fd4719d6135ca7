"""A second screen within the test: a station of the virtual rig, its server, and a reader."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.station import MeasuringStation
from ocmm_core.station.stream import StreamOptions
from ocmm_serve.screen import ScreenAccess, ScreenOptions, ScreenServer, ScreenSnapshot
from ocmm_serve.site import close_station
from tests.host import HANG_S

SECRET = "a-secret-of-the-test-station"  # noqa: S105 - of a server that lives for one test


def read_code(pixels: NDArray[np.uint8]) -> str:
    """Return the text of a picture of a QR code; empty if there is none."""
    found, _, _ = cv2.QRCodeDetector().detectAndDecode(np.pad(pixels, 32, constant_values=255))
    return str(found)


@dataclass(frozen=True, slots=True)
class ServedScreen:
    station: MeasuringStation
    server: ScreenServer
    access: ScreenAccess

    @property
    def url(self) -> str:
        return "http://{}:{}/".format(*self.server.address)

    def page(self, token: str) -> str:
        return f"{self.url}#{token}"


@contextmanager
def served_screen(
    out: Path,
    plan: Path | None = None,
    *,
    control: bool = True,
    measured: bool = True,
    stream: StreamOptions | None = None,
) -> Iterator[ServedScreen]:
    """Serve a job that the virtual hand has measured, or has not begun; nothing may fail."""
    failures: list[Exception] = []
    request = StationRequest(
        plan=plan or resource("plans", "quick.toml"), out=out, frame_rate_hz=500, stay=not measured,
        idle=not measured,
    )  # fmt: skip
    station = build_station(request).station
    access = ScreenAccess(SECRET, control)
    try:
        server = ScreenServer(
            station, ScreenOptions(stream or StreamOptions(), access), failures.append
        )
        server.start()
        try:
            station.start()
            if measured:
                assert station.wait_finished(HANG_S)
            yield ServedScreen(station, server, access)
        finally:
            assert server.close()
    finally:
        close_station(station)
    assert failures == []


@dataclass(slots=True)
class Reader:
    """A page without a browser: every snapshot is checked by the schema and acknowledged."""

    talk: Connection
    job: dict[str, Any] = field(default_factory=dict)
    latest: dict[str, Any] = field(default_factory=dict)
    answers: list[dict[str, Any]] = field(default_factory=list)
    asked: int = 0

    def next(self, *, acknowledge: bool = True) -> dict[str, Any]:
        """Return the next snapshot."""
        text = self.talk.recv(HANG_S)
        msgspec.json.decode(text, type=ScreenSnapshot, strict=True)
        self.latest = json.loads(text)
        self.job = self.latest["job"] or self.job
        self.answers += self.latest["answers"]
        if acknowledge:
            self.talk.send(json.dumps({"seen": self.latest["number"]}))
        return self.latest

    def current(self) -> dict[str, Any]:
        """Return the job once the page shows its present state."""
        while not (self.next()["current"] and self.job):
            pass
        return self.job

    def act(self, what: str, **other: object) -> dict[str, Any]:
        """Press a button as the page does, and return the answer."""
        self.asked += 1
        call = {"do": what, "id": self.asked, "job": self.job["job"]}
        call["sequence"] = self.job["sequence"]
        self.talk.send(json.dumps(call | other))
        while not any(one["id"] == self.asked for one in self.answers):
            self.next()
        return next(one for one in self.answers if one["id"] == self.asked)


@contextmanager
def reading(screen: ServedScreen, token: str, language: str = "en") -> Iterator[Reader]:
    """Open a page with a token."""
    address = f"ws://127.0.0.1:{screen.server.address[1]}/live"
    with connect(address, compression=None, open_timeout=HANG_S) as talk:
        talk.send(json.dumps({"token": token, "language": language}))
        yield Reader(talk)
