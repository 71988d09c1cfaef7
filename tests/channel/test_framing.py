"""Framing: cited sizes, and fragments that hold the message exactly."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.framing import FRAMINGS, Framing
from teleop_sim.channel.messages import Chat
from teleop_sim.core.errors import BadInput

every_framing = pytest.mark.parametrize("name", sorted(FRAMINGS))
payloads = st.integers(0, 20_000)


def check_fragments(framing, payload_bytes):
    """Headers and payload add up; all are full but the last; there are no more than it takes."""
    sizes = framing.fragments(payload_bytes)
    assert sum(sizes) == 8 * (payload_bytes + framing.header_bytes * len(sizes))
    if framing.mtu_bytes == 0:
        assert len(sizes) == 1
        return
    assert all(bits == 8 * framing.mtu_bytes for bits in sizes[:-1])
    assert 8 * framing.header_bytes <= sizes[-1] <= 8 * framing.mtu_bytes
    assert len(sizes) == max(1, math.ceil(payload_bytes / (framing.mtu_bytes - framing.header_bytes)))


@every_framing
@given(payload_bytes=payloads)
def test_every_framing_cuts_a_message_without_loss(name, payload_bytes):
    check_fragments(FRAMINGS[name], payload_bytes)


@given(st.integers(0, 100), st.integers(1, 300), payloads)
def test_any_framing_cuts_a_message_without_loss(header_bytes, room_bytes, payload_bytes):
    check_fragments(Framing(header_bytes, header_bytes + room_bytes), payload_bytes)
    check_fragments(Framing(header_bytes), payload_bytes)


def test_headers_are_the_cited_ones():
    # IPv4 20 (RFC 791), UDP 8 (RFC 768), TCP 20 (RFC 9293), TCP time stamps 12 (RFC 7323).
    headers = {name: framing.header_bytes for name, framing in FRAMINGS.items()}
    assert headers == {"raw": 0, "udp_ip": 20 + 8, "tcp_ip": 20 + 20, "tcp_ip_timestamps": 20 + 20 + 12, "chat": 40}


def test_closed_forms_of_fragments():
    assert Framing(0).fragments(18) == (144,)
    assert FRAMINGS["tcp_ip"].fragments(1460) == (12_000,)
    assert FRAMINGS["tcp_ip"].fragments(1461) == (12_000, 8 * 41)
    assert FRAMINGS["udp_ip"].fragments(2 * 1472) == (12_000, 12_000)
    assert FRAMINGS["udp_ip"].fragments(0) == (8 * 28,)


def test_a_chat_line_pays_its_line_end_once():
    line = Chat("/RESTART").encode()
    assert FRAMINGS["chat"].fragments(len(line)) == (8 * (40 + 9),)


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: Framing(-1, -1), ["header_bytes", "mtu_bytes"]),
        (lambda: Framing(1.5, 1500), ["header_bytes"]),
        (lambda: Framing(40, 40), ["mtu_bytes"]),
    ],
)
def test_every_impossible_framing_is_named(make, wrong):
    with pytest.raises(BadInput) as refused:
        make()
    assert [p.where for p in refused.value.problems] == wrong
    assert all(p.hint for p in refused.value.problems)
