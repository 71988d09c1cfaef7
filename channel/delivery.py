"""Endpoints: what turns two directions that may lose packets into messages that arrive, once, or are given up.

An endpoint sits at each site. It frames what its application sends, repeats it as its ``Delivery`` says, answers the
other endpoint, and hands on what it may. All frames are packets of the directions and are charged there. Where
neither side acknowledges, nothing is added and the packets are those of the bare link.

Rules of the frames: data and their acknowledgements cost 3 bytes (flag, number); a best-effort message costs the flag
byte if the other side acknowledges, else nothing. Topics of packets: the message's, ``ack`` and ``skip``. TCP has
segments instead, whose 40 bytes of headers cannot be taken for frames (``tcp.py``).

What a delivery repeats, and what it says to the other endpoint, is never superseded under the discipline ``newest``:
an acknowledgement of one number does not stand for that of another. ``newest`` counts for best effort alone.

The end: with best effort, or with finite ``tries`` or ``give_up_s``, nothing happens any more some time after the last
message, and ``env.run()`` returns. A delivery that never gives up keeps the clock going for ever on a link that
delivers nothing (all is lost, or no budget is left): give ``env.run`` an ``until``. Custody that knows the dark to last
does not.

Not modelled: acknowledgements in the head of data, congestion control, round trips that are measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import simpy

from teleop_sim.channel.arq import ACK, PLAIN, Delivery, Frame, SelectiveRepeat, StopAndWait, unpack_frame
from teleop_sim.channel.custody import Custody, out_s
from teleop_sim.channel.fates import Book, Fate, Tell
from teleop_sim.channel.halves import Notify, Receiver, Sender
from teleop_sim.channel.link import Direction, DirectionSettings, LinkClosed, Receive
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.tcp import Tcp
from teleop_sim.channel.tcp_halves import TcpListener, TcpSender
from teleop_sim.channel.tcp_wire import Segment, is_segment, unpack_segment
from teleop_sim.core.records import Emit, PacketEnded, Record

__all__ = [
    "DELIVERIES",
    "BestEffort",
    "Connection",
    "Custody",
    "Delivery",
    "Endpoint",
    "Fate",
    "SelectiveRepeat",
    "StopAndWait",
    "Tcp",
    "connect",
]


@dataclass(frozen=True, slots=True)
class BestEffort:
    """Sent once, never answered: what the link loses is lost, and the order is the link's."""

    acknowledged: ClassVar[bool] = False
    in_order: ClassVar[bool] = False
    knows_dark: ClassVar[bool] = False
    window: ClassVar[int] = 1
    timeout_s: ClassVar[float | None] = None
    tries: ClassVar[float] = 1


DELIVERIES: dict[str, type[Delivery]] = {
    "best_effort": BestEffort,
    "stop_and_wait": StopAndWait,
    "selective_repeat": SelectiveRepeat,
    "custody": Custody,
    "tcp": Tcp,
}
"""Name in a scenario to delivery; the fields are its keys."""


def _ignore_fate(_: Fate) -> None:
    pass


def _ignore_news(_number: int, _acknowledged: bool) -> None:
    pass


class Endpoint:
    """One site's end of both directions. Make two, then ``connect`` them.

    Attributes:
        delivery: how this site's messages get across.
        book: counts and fates of this site's messages.

    """

    def __init__(
        self,
        env: simpy.Environment,
        delivery: Delivery,
        receive: Receive,
        tell: Tell = _ignore_fate,
        notify: Notify = _ignore_news,
        ack_priority: int = 0,
    ) -> None:
        """``receive`` gets each message of the other site.

        ``tell`` gets the fate of each message of this site, for the log; ``notify`` gets what the sender itself knows:
        the number of a message and whether it was acknowledged (the other endpoint has it, and may still hold it back
        for those before it) or given up (a late copy may still get through). A site acts on ``notify`` only.
        ``ack_priority`` is that of the acknowledgements which this site sends.
        """
        self.delivery = delivery
        self.book = Book(env, tell, best_effort=not delivery.acknowledged)
        self._env = env
        self._receive = receive
        self._notify = notify
        self._ack_priority = ack_priority
        self._free_s: float = env.now
        self._next_of_peer = 0
        self._closed = False

    def join(self, out: Direction, back: Direction, peer: Endpoint) -> None:
        """Put the endpoint between its directions; ``connect`` does it for both.

        Raises:
            BadInput: TCP over a direction whose fragments are too short for it.

        """
        self._out = out
        self._peer = peer
        self._framed = self.delivery.acknowledged or peer.delivery.acknowledged
        self._sender = self._make_sender((out.settings, back.settings))
        self._receiver = Receiver(peer.delivery.window, peer.delivery.in_order)
        self._listener = None
        if isinstance(peer.delivery, Tcp):
            ways = (back.settings, out.settings)
            self._listener = TcpListener(peer.delivery, ways, self._put, self._called, self._ack_priority)

    def _make_sender(self, ways: tuple[DirectionSettings, DirectionSettings]) -> Sender | TcpSender:
        if isinstance(self.delivery, Tcp):
            by, priority = self.delivery, self._ack_priority
            return TcpSender(self._env, by, ways, self._put, self.book, self._notify, priority)
        return Sender(self._env, self.delivery, ways, self._transmit, self.book, self._notify)

    def send(self, topic: str, payload: bytes, text: str = "", priority: int = 0) -> int:
        """Entrust a message; returns its number among those of this endpoint, from 0.

        Raises:
            LinkClosed: after ``close``.
            BadMessage: an empty message, by TCP: a stream of bytes does not hold it.

        """
        if self._closed:
            raise LinkClosed(self._out.name, topic)
        parts = self._sender.parts(topic, payload) if isinstance(self._sender, TcpSender) else 1
        number = self.book.enter(topic, len(payload), text, parts)
        if self.delivery.acknowledged:
            self._sender.offer(number, topic, payload, text, priority)
            return number
        data = Frame(PLAIN, payload=payload).pack() if self._framed else payload
        self._offer(topic, data, text, priority, (number, 0))
        return number

    def arrived(self, data: bytes) -> None:
        """What the direction towards this site calls with each payload.

        Raises:
            BadMessage: bytes that are no frame, although one side acknowledges.

        """
        if not self._framed:
            self._receive(data)
        elif is_segment(data):
            self._segment_arrived(unpack_segment(data))
        else:
            self._frame_arrived(unpack_frame(data))

    def _frame_arrived(self, frame: Frame) -> None:
        if frame.kind == PLAIN:
            self._receive(frame.payload)
        elif frame.kind != ACK:
            self._take(frame)
        elif isinstance(self._sender, Sender):
            self._sender.acknowledge(frame.number)

    def _segment_arrived(self, segment: Segment) -> None:
        if not segment.to_listener:
            if isinstance(self._sender, TcpSender):
                self._sender.arrived(segment)
        elif self._listener is not None:
            for payload in self._listener.arrived(segment):
                self._peer.book.deliver(self._next_of_peer)
                self._next_of_peer += 1
                self._receive(payload)

    def _called(self, port: int) -> None:
        """The other site opened a new connection: of an earlier one nothing more is taken."""
        first = self._peer.book.firsts[port]
        for number in range(self._next_of_peer, first):
            self._peer.book.passed_over(number)
        self._next_of_peer = first

    def watch(self, emit: Emit) -> Emit:
        """An ``emit`` for the direction out of this site, which keeps the book."""

        def seen(record: Record) -> None:
            emit(record)
            if isinstance(record, PacketEnded):
                self.book.packet_ended(record)

        return seen

    def close(self) -> None:
        """End the run after the directions were closed: every open message gets its fate. Again: no effect."""
        self._closed = True
        self._sender.close()
        self.book.close()

    def _transmit(self, topic: str, frame: Frame, text: str, priority: int, copy_of: int | None) -> float:
        return self._offer(topic, frame.pack(), text, priority, None if copy_of is None else (copy_of, 0), keep=True)

    def _put(self, topic: str, segment: Segment, text: str, priority: int, copy_of: tuple[int, int] | None) -> None:
        self._offer(topic, segment.pack(), text, priority, copy_of, keep=True)

    def _offer(
        self, topic: str, data: bytes, text: str, priority: int, copy_of: tuple[int, int] | None, keep: bool = False
    ) -> float:
        """Offer bytes to the link; when their turn should come, by what this endpoint has offered before [s].

        ``copy_of``: number and part of the message that they carry. ``keep``: nothing may supersede them.
        """
        if copy_of is not None:
            # Before the send: the packet may end within it, where a queue is full.
            number, part = copy_of
            self.book.copy(number, self._out.sent, part)
        turn_s = max(self._env.now, self._free_s)
        self._free_s = out_s(self.delivery, turn_s, len(data), self._out.settings)
        self._out.send(topic, data, text, priority, keep=keep)
        return turn_s

    def _take(self, frame: Frame) -> None:
        """Answer every copy, for its acknowledgement may be what was lost; hand on what is new."""
        taken, over = self._receiver.take(frame)
        self._transmit("ack", Frame(ACK, frame.number), f"ack {frame.number}", self._ack_priority, None)
        for number in over:
            self._peer.book.passed_over(number)
        for one in taken:
            self._peer.book.deliver(one.number)
            self._receive(one.payload)


MakeDirection = Callable[[DirectionName, Receive, Emit], Direction]
"""Makes a direction of that name with its settings, its receiver and its place for records."""


@dataclass(frozen=True, slots=True)
class Connection:
    """Two endpoints and the directions between them: ``station`` sends ``up``, ``site`` sends ``down``."""

    station: Endpoint
    site: Endpoint
    up: Direction
    down: Direction

    def close(self) -> None:
        """End the run: packets first, then messages."""
        for part in (self.up, self.down, self.station, self.site):
            part.close()


def connect(make: MakeDirection, station: Endpoint, site: Endpoint, emit: Emit) -> Connection:
    """Make both directions and put the endpoints at their ends; packets are recorded through ``emit``."""
    up = make("up", site.arrived, station.watch(emit))
    down = make("down", station.arrived, site.watch(emit))
    station.join(up, down, site)
    site.join(down, up, station)
    return Connection(station, site, up, down)
