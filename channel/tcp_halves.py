"""The half of a TCP connection (``tcp.py``) that opens, sends and repeats; the other is in ``tcp_listener.py``."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import simpy

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.drops import GAVE_UP, NO_CONNECTION
from teleop_sim.channel.fates import Book
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.tcp import Tcp
from teleop_sim.channel.tcp_listener import Put, TcpListener
from teleop_sim.channel.tcp_recovery import Recovery
from teleop_sim.channel.tcp_timer import RoundTrips
from teleop_sim.channel.tcp_wire import FIRST_PORT, PORTS, SEQUENCE_NUMBERS, WINDOW_FIELD_MAX, Segment

__all__ = ["TcpListener", "TcpSender"]


@dataclass(slots=True)
class _Part:
    """A piece of a message; ``seq`` of its first byte, counted without wrapping."""

    number: int
    part: int
    topic: str
    data: bytes
    push: bool
    text: str
    priority: int
    seq: int = 0


class TcpSender:
    """The side that opens, sends and repeats. It acts on the clock and on what arrives, never on the ``book``."""

    def __init__(
        self,
        env: simpy.Environment,
        delivery: Tcp,
        ways: tuple[DirectionSettings, DirectionSettings],
        put: Put,
        book: Book,
        notify: Callable[[int, bool], None],
        control_priority: int,
    ) -> None:
        """``control_priority``: of packets without data.

        Raises:
            BadInput: no segment fits the link.

        """
        self._env = env
        self._delivery = delivery
        self._segment_bytes = delivery.segment_bytes(*ways)
        self._put = put
        self._book = book
        self._notify = notify
        self._control_priority = control_priority
        self._waiting: deque[_Part] = deque()
        self._flying: deque[_Part] = deque()
        self._port, self._connections = FIRST_PORT, 0
        self._calling = self._open = self._closed = False
        # The oldest number that is not acknowledged, and the next to be sent.
        self._oldest = self._next = 0
        self._trips = RoundTrips()
        self._recovery = Recovery()
        self._timed: tuple[int, float] | None = None
        self._alarm: simpy.Event | None = None
        self._alarm_is_last = False
        self._progress_s: float = env.now
        if delivery.open_at_start:
            self._start(0)
            self._open, self._oldest = True, self._next

    def parts(self, topic: str, payload: bytes) -> int:
        """Segments of a message.

        Raises:
            BadMessage: it is empty: a stream of bytes does not hold it.

        """
        if not payload:
            raise BadMessage(topic, "a message without bytes", "TCP carries bytes only: give one or more.")
        return len(range(0, len(payload), self._segment_bytes))

    def offer(self, number: int, topic: str, payload: bytes, text: str, priority: int) -> None:
        """Take over a message of one byte or more. Numbers come in order, without gaps."""
        size = self._segment_bytes
        for part, begin in enumerate(range(0, len(payload), size)):
            data, push = payload[begin : begin + size], begin + size >= len(payload)
            self._waiting.append(_Part(number, part, topic, data, push, text, priority))
        if self._open:
            self._fill()
        elif not self._calling:
            self._call(number)

    def arrived(self, segment: Segment) -> None:
        """A segment of the listener. What belongs to an earlier connection or says nothing new has no effect."""
        if self._closed or segment.port != self._port or segment.ack is None:
            return
        if self._calling and segment.syn:
            self._established()
        elif self._open and segment.syn:
            # Our last answer may be what was lost (RFC 9293, section 3.10.7.4).
            self._answer()
        elif self._open:
            self._acknowledged(self._oldest + (segment.ack - self._oldest) % SEQUENCE_NUMBERS)

    def close(self) -> None:
        """Repeat nothing any more."""
        self._closed = True

    # The connection

    def _start(self, number: int) -> None:
        """A new connection, whose first message has this number."""
        self._port = FIRST_PORT + self._connections % PORTS
        self._connections += 1
        self._book.firsts[self._port] = number
        self._oldest, self._next = 0, 1
        self._trips, self._recovery = RoundTrips(), Recovery()

    def _call(self, number: int) -> None:
        self._start(number)
        self._calling = True
        self._timed = (1, self._env.now)
        self._progress_s = self._env.now
        self._syn()
        self._set_alarm()

    def _syn(self) -> None:
        segment = Segment(self._port, to_listener=True, seq=0, ack=None, syn=True, window_bytes=WINDOW_FIELD_MAX)
        self._put("syn", segment, "syn", self._control_priority, None)

    def _established(self) -> None:
        self._calling, self._open, self._oldest = False, True, 1
        if self._timed is None:
            self._trips = self._trips.after_syn_lost()
        else:
            self._measure(1)
        self._alarm = None
        self._answer()
        self._fill()

    def _answer(self) -> None:
        segment = self._segment(self._next)
        self._put("ack", segment, "ack of the handshake", self._control_priority, None)

    def _segment(self, seq: int, push: bool = False, data: bytes = b"") -> Segment:
        # The listener's SYN has number 0, and it never sends data.
        number = seq % SEQUENCE_NUMBERS
        return Segment(self._port, True, number, 1, push=push, window_bytes=WINDOW_FIELD_MAX, data=data)

    # Data

    def _fill(self) -> None:
        while self._waiting and len(self._flying) < self._delivery.window:
            part = self._waiting.popleft()
            part.seq = self._next
            self._next += len(part.data)
            if not self._flying:
                self._progress_s = self._env.now
            self._flying.append(part)
            # One at a time is timed, and none that was sent twice (Karn): RFC 6298, section 3.
            self._timed = self._timed or (self._next, self._env.now)
            self._send(part)
            if self._alarm is None:
                self._set_alarm()

    def _send(self, part: _Part) -> None:
        segment = self._segment(part.seq, part.push, part.data)
        self._put(part.topic, segment, part.text, part.priority, (part.number, part.part))

    def _acknowledged(self, number: int) -> None:
        if number == self._oldest and self._flying:
            self._duplicate()
        if not self._oldest < number <= self._next:
            return
        self._oldest, self._progress_s = number, self._env.now
        self._measure(number)
        done: list[int] = []
        while self._flying and self._flying[0].seq < number:
            part = self._flying.popleft()
            if part.push:
                done.append(part.number)
        self._recovery, hole = self._recovery.advanced(number)
        self._alarm = None
        if hole:
            self._repeat()
        elif self._flying:
            self._set_alarm()
        self._fill()
        for one in done:
            self._notify(one, True)

    def _duplicate(self) -> None:
        """An acknowledgement like the last: one segment has arrived, and it was not the oldest."""
        self._recovery, lost = self._recovery.duplicate(self._oldest, self._next)
        if lost:
            self._repeat()

    def _repeat(self) -> None:
        """Offer the oldest segment again; the timer begins anew, as RFC 6675, section 6, allows."""
        self._timed = None
        self._send(self._flying[0])
        self._set_alarm()

    def _measure(self, number: int) -> None:
        """Everything before ``number`` has arrived."""
        if self._timed is not None and self._timed[0] <= number:
            self._trips = self._trips.measured(self._env.now - self._timed[1])
            self._timed = None

    # The timer: RFC 6298, section 5

    def _set_alarm(self) -> None:
        last_s = self._progress_s + self._delivery.give_up_s
        when_s = self._env.now + self._trips.rto_s
        self._alarm_is_last = last_s <= when_s
        alarm = self._env.timeout(max(0.0, min(last_s, when_s) - self._env.now))
        alarm.callbacks.append(lambda _: self._wake(alarm))
        self._alarm = alarm

    def _wake(self, alarm: simpy.Event) -> None:
        if self._closed or self._alarm is not alarm:
            return
        if self._alarm_is_last:
            self._give_up()
            return
        self._trips = self._trips.backed_off()
        if self._calling:
            self._timed = None
            self._syn()
            self._set_alarm()
        else:
            self._recovery = self._recovery.timed_out(self._next)
            self._repeat()

    def _give_up(self) -> None:
        lost = dict.fromkeys(part.number for part in (*self._flying, *self._waiting))
        reason = NO_CONNECTION if self._calling else GAVE_UP
        self._flying.clear()
        self._waiting.clear()
        self._calling = self._open = False
        self._alarm = self._timed = None
        for number in lost:
            self._book.abandon(number, reason)
        for number in lost:
            self._notify(number, False)
