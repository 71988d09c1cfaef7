"""TCP segments as they cross: an IPv4 header, a TCP header, data. 40 bytes of headers, no options.

Layout after RFC 791 (section 3.1) and RFC 9293 (section 3.1). What tells the simulated sites nothing is zero: addresses
(two sites), checksums (bits are never damaged), identification (segments are not cut by IP).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from teleop_sim.channel.codec import BadMessage

HEADER_BYTES = 40
"""IPv4 without options 20 (RFC 791), TCP without options 20 (RFC 9293)."""

MTU_MAX_BYTES = 65535
"""IPv4's total length has 16 bits."""

LISTENER_PORT = 5000
FIRST_PORT, PORTS = 49152, 16384
"""Ports of those who open: the dynamic ones (RFC 6335, section 6). Each connection takes the next."""

SEQUENCE_NUMBERS = 1 << 32
WINDOW_FIELD_MAX = 65535

_HEAD = struct.Struct(">BBHHHBBHII HHIIBBHHH")
_VERSION_AND_LENGTH, _DONT_FRAGMENT, _HOPS, _TCP, _WORDS = 0x45, 0x4000, 64, 6, 5 << 4
_SYN, _PSH, _ACK = 0x02, 0x08, 0x10


@dataclass(frozen=True, slots=True)
class Segment:
    """What crosses.

    Attributes:
        port: of the side that opened; it names the connection.
        to_listener: whether it goes to the side that was called.
        seq: of the first byte, modulo 2**32; a SYN takes a number too.
        ack: the number that is expected next, or None: the flag ACK is not set.
        syn: opens a connection.
        push: its last byte ends a message.
        window_bytes: room that the sender of this segment offers, 16 bits.
        data: bytes of a message.

    """

    port: int
    to_listener: bool
    seq: int
    ack: int | None
    syn: bool = False
    push: bool = False
    window_bytes: int = 0
    data: bytes = b""

    def pack(self) -> bytes:
        """Bytes on the wire, headers first."""
        ports = (self.port, LISTENER_PORT) if self.to_listener else (LISTENER_PORT, self.port)
        flags = _SYN * self.syn | _PSH * self.push | _ACK * (self.ack is not None)
        length = HEADER_BYTES + len(self.data)
        ip = (_VERSION_AND_LENGTH, 0, length, 0, _DONT_FRAGMENT, _HOPS, _TCP, 0, 0, 0)
        return _HEAD.pack(*ip, *ports, self.seq, self.ack or 0, _WORDS, flags, self.window_bytes, 0, 0) + self.data


def is_segment(data: bytes) -> bool:
    """Whether bytes are a segment rather than a frame of ``arq.py``: those begin with 0 to 3."""
    return data[:1] == bytes((_VERSION_AND_LENGTH,))


def unpack_segment(data: bytes) -> Segment:
    """Inverse of ``Segment.pack``.

    Raises:
        BadMessage: the bytes are no such segment.

    """
    head = _HEAD.unpack(data[:HEADER_BYTES]) if len(data) >= HEADER_BYTES else ()
    if not head or (head[0], head[2], head[6]) != (_VERSION_AND_LENGTH, len(data), _TCP):
        hint = "Both ends of a link must be told the same deliveries."
        raise BadMessage("segment", f"{len(data)} bytes that start with {data[:3].hex() or 'nothing'}", hint)
    source, target, seq, ack, _, flags, window_bytes = head[10:17]
    to_listener = target == LISTENER_PORT
    return Segment(
        port=source if to_listener else target,
        to_listener=to_listener,
        seq=seq,
        ack=ack if flags & _ACK else None,
        syn=bool(flags & _SYN),
        push=bool(flags & _PSH),
        window_bytes=window_bytes,
        data=data[HEADER_BYTES:],
    )
