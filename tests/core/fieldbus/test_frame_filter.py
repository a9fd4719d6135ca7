"""A socket receives frames with its own indices only: the kernel drops the others."""

from __future__ import annotations

import socket

import pytest

from ocmm_core.fieldbus.wire import Command, Datagram, encode_frame
from ocmm_core.fieldbus.wire._service import FIRST_INDEX
from ocmm_core.fieldbus.wire._sockets import INDICES, receive_only, waiting_on
from ocmm_core.fieldbus.wire._tally import N_INDICES


@pytest.mark.parametrize(
    "indices",
    [INDICES, INDICES[:N_INDICES], INDICES[:FIRST_INDEX], INDICES[FIRST_INDEX:], INDICES[7:8]],
)
def test_each_index_comes_exactly_to_the_sockets_that_want_it(indices: range) -> None:
    """All 256 indices, by a pair of datagram sockets, which the kernel filters likewise."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with near, far:
        far.setblocking(False)
        receive_only(far, indices)
        received = []
        for index in INDICES:
            frame = encode_frame(index, [Datagram(Command.BRD, 0, 0x0130, bytes(2))])
            near.send(frame)
            # Too short for an index.
            near.send(frame[:17])
            received += waiting_on(far)
    assert [frame[17] for frame in received] == list(indices)
    assert {len(frame) for frame in received} == {60}
