"""The half of a TCP connection (``tcp.py``) that is called and answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.tcp import Tcp
from teleop_sim.channel.tcp_wire import FIRST_PORT, PORTS, SEQUENCE_NUMBERS, WINDOW_FIELD_MAX, Segment


class Put(Protocol):
    """Offers a segment to the link now."""

    def __call__(self, topic: str, segment: Segment, text: str, priority: int, copy_of: tuple[int, int] | None) -> None:
        """``text`` and ``copy_of``, numbers of a message and of its part, are for the log."""


class TcpListener:
    """The side that is called: answers each segment, and hands the stream on in order, message by message.

    It keeps no timer of its own for its SYN+ACK (a real one does): a repeated SYN makes it answer again.
    """

    def __init__(
        self,
        delivery: Tcp,
        ways: tuple[DirectionSettings, DirectionSettings],
        put: Put,
        opened: Callable[[int], None],
        control_priority: int,
    ) -> None:
        """``delivery`` and ``ways`` (out, back) are the sender's; ``opened`` is told the port of a new connection."""
        self._put = put
        self._opened = opened
        self._control_priority = control_priority
        self._window_bytes = min(WINDOW_FIELD_MAX, delivery.window * delivery.segment_bytes(*ways))
        self._port = FIRST_PORT if delivery.open_at_start else None
        self._established = delivery.open_at_start
        self._expected = 1
        self._held: dict[int, Segment] = {}
        self._pieces: list[bytes] = []

    def arrived(self, segment: Segment) -> tuple[bytes, ...]:
        """Messages that a segment of the sender completes, in order. It is answered before."""
        if segment.syn:
            self._called(segment)
            return ()
        if segment.port != self._port:
            return ()
        self._established = True
        if not segment.data:
            return ()
        half = SEQUENCE_NUMBERS // 2
        number = self._expected + (segment.seq - self._expected + half) % SEQUENCE_NUMBERS - half
        if number >= self._expected:
            self._held[number] = segment
        messages = self._in_order()
        self._answer("ack")
        return messages

    def _called(self, segment: Segment) -> None:
        newer = self._port is None or 0 < (segment.port - self._port) % PORTS < PORTS // 2
        if newer:
            self._port, self._established, self._expected = segment.port, False, 1
            self._held.clear()
            self._pieces.clear()
            self._opened(segment.port)
        if segment.port == self._port:
            self._answer("ack" if self._established else "syn_ack")

    def _in_order(self) -> tuple[bytes, ...]:
        ready: list[bytes] = []
        while (segment := self._held.pop(self._expected, None)) is not None:
            self._expected += len(segment.data)
            self._pieces.append(segment.data)
            if segment.push:
                ready.append(b"".join(self._pieces))
                self._pieces.clear()
        return tuple(ready)

    def _answer(self, topic: str) -> None:
        assert self._port is not None
        syn, ack = topic == "syn_ack", self._expected % SEQUENCE_NUMBERS
        segment = Segment(self._port, False, 0 if syn else 1, ack, syn=syn, window_bytes=self._window_bytes)
        self._put(topic, segment, f"{topic} {ack}", self._control_priority, None)
