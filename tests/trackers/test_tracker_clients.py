"""The software trackers, read by public clients: natnet, qtm-rt, ndicapi."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from ocmm_core.camera import load_tracker
from ocmm_core.documents import resource
from ocmm_sim.trackers import (
    MarkerEncoder,
    NatNetEncoder,
    NdiEncoder,
    Newest,
    QtmEncoder,
    TrackerServer,
)
from tests.host import not_run
from tests.trackers.tracker_bench import TRACKER, places_of, playing

_COUNT = 100
_FIRST_NS = 1_764_500_000_000_000_000
_OPTITRACK, _NDI = resource("rigs", "tracker_natnet.toml"), resource("rigs", "tracker_ndi.toml")


def public(name: str) -> Any:
    """Return the module of a public client, or end the test as NOT RUN."""
    if find_spec(name) is None:
        not_run(f"{name} is not installed")
    return import_module(name)


@contextmanager
def served(encoder: MarkerEncoder, rate_hz: int = 100) -> Iterator[tuple[int, list[np.ndarray]]]:
    """Yield the port of a server that plays frames, and their markers."""
    rng, server = np.random.default_rng(1), TrackerServer(encoder)
    sent = [places_of(rng) for _ in range(_COUNT)]
    frames = [(one, _FIRST_NS + round(n * 1e9 / rate_hz)) for n, one in enumerate(sent)]
    try:
        with playing(server, encoder, frames) as (opened, _):
            opened.set()
            yield server.port, sent
    finally:
        server.close()


@pytest.mark.parametrize("version", [(3, 0), (3, 1)])
def test_natnet_reads_the_same(version: tuple[int, int]) -> None:
    """N = 100 frames; natnet 0.3.0 misreads the end of frames from 4.1 on."""
    client = public("natnet")
    found: list[Any] = []
    with served(NatNetEncoder(load_tracker(_OPTITRACK), version)) as (port, sent):
        theirs = client.NatNetClient(
            server_ip_address="127.0.0.1", command_port=port, use_multicast=False
        )
        theirs.on_data_frame_received_event.handlers.append(found.append)
        with theirs:
            while len(found) < _COUNT // 2:
                theirs.update_sync()
    # Frames before its first event are lost to it.
    start = found[0].prefix.frame_number - 1
    for frame, places in zip(found, sent[start:], strict=False):
        markers = {(one.model_id, one.marker_id): one for one in frame.labeled_markers}
        for led, place in enumerate(places):
            one = markers[1, led + 1]
            np.testing.assert_allclose(one.pos, place / 1000.0, atol=1e-7)
            assert one.point_cloud_solved
            assert not one.occluded
        assert frame.rigid_bodies[0].tracking_valid
        ticks = (_FIRST_NS + (frame.prefix.frame_number - 1) * 10**7) // 100
        assert frame.suffix.stamp_camera_mid_exposure == ticks


def test_qtm_rt_reads_the_same() -> None:
    client = public("qtm_rt")
    found: list[Any] = []

    async def read(port: int) -> str:
        theirs = await client.connect("127.0.0.1", port=port, version="1.25")
        xml: bytes = await theirs.get_parameters(parameters=["3d"])
        await theirs.stream_frames(frames="allframes", components=["3dres"], on_packet=found.append)
        while len(found) < _COUNT:
            await asyncio.sleep(1e-3)
        theirs.disconnect()
        return xml.decode()

    with served(QtmEncoder(load_tracker(TRACKER))) as (port, sent):
        xml = asyncio.run(asyncio.wait_for(read(port), 20.0))
    assert all(f"<Name>M{n}</Name>" in xml for n in range(1, 9))
    for n, (frame, places) in enumerate(zip(found, sent, strict=True)):
        _, markers = frame.get_3d_markers_residual()
        np.testing.assert_allclose([one[:3] for one in markers[:6]], places, atol=2e-5)
        assert np.isnan(markers[6].x)
        assert frame.timestamp == (_FIRST_NS + n * 10**7) // 1000


@pytest.mark.parametrize("newest", ["BX", "TX"])
def test_ndicapi_reads_the_same(newest: Newest) -> None:
    client = public("ndicapy")
    with served(NdiEncoder(load_tracker(_NDI), newest), 60) as (port, sent):
        theirs = client.ndiOpenNetwork("127.0.0.1", port)
        for command in ("INIT:", "PHSR:02", "PINIT:01", "PENA:01D", "TSTART:"):
            client.ndiCommand(theirs, command)
            assert client.ndiGetError(theirs) == 0
        for n, places in enumerate(sent):
            # It takes the reply as text, but has parsed it before.
            with suppress(UnicodeDecodeError):
                client.ndiCommand(theirs, f"{newest}:1001")
            assert client.ndiGetError(theirs) == 0
            frame = getattr(client, f"ndiGet{newest}Frame")(theirs, b"\x01")
            assert frame == 500_000 + n
            strays = getattr(client, f"ndiGet{newest}PassiveStray")
            found = [strays(theirs, one) for one in range(6)]
            np.testing.assert_allclose(found, places, atol=5.1e-3 if newest == "TX" else 2e-5)
            assert getattr(client, f"ndiGet{newest}Transform")(theirs, b"\x01") == "MISSING"
        client.ndiCommand(theirs, "TSTOP:")
        client.ndiCloseNetwork(theirs)
