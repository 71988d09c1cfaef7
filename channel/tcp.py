"""TCP as a delivery: a connection opened by a handshake, a stream of bytes in order, repeated after RFC 6298 and 6582.

Each side that sends opens a connection of its own, in which data go one way and acknowledgements the other, as with
ROS's publishers. What is charged: every packet is an IPv4 and a TCP header (40 bytes, ``tcp_wire.py``) and its data;
nothing else. Sequence numbers, acknowledgements, the kind of a segment and the end of a message (flag PSH) stand in
the header. ``header_bytes`` of the direction come on top: they are those of layers below IP. 40 or more are taken for
TCP's and IP's own, which would be charged twice, and refused. Topics of packets: the message's, ``syn``, ``syn_ack``,
``ack``.

Not modelled: congestion control and slow start (RFC 5681: the window is fixed), delayed and selective acknowledgements,
acknowledgements in the head of data, options, the end of a connection (FIN, RST), keeping small messages back (Nagle).
Without the option of timestamps (RFC 7323) no round trip of a repetition is ever measured (Karn): while there is always
a hole the time-out that has doubled stays. PSH as the end of a message is what common systems do and no standard
promises.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from teleop_sim.channel.arq import Delivery
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.tcp_wire import HEADER_BYTES, MTU_MAX_BYTES
from teleop_sim.core.errors import BadInput, Problem


@dataclass(frozen=True, slots=True)
class Tcp:
    """Messages in a TCP connection, which is opened for the first of them.

    Attributes:
        window: segments on their way at once. 44 of 1460 bytes are the 65,535 that a header without window scaling can
            offer (RFC 9293, section 3.1). It is fixed (assumed): there is no congestion control.
        give_up_s: from the last progress to the end of the connection; ``inf``: never. 924.6 s is Linux's with its
            default of 15 repetitions (kernel documentation, ip-sysctl, ``tcp_retries2``); RFC 9293, section 3.8.3,
            wants 100 s or more. What was entrusted is given up then; the next message opens a new connection.
        open_at_start: the connection was opened before the run, without any measured round trip; nothing is charged.
        mtu_bytes: largest packet, its 40 bytes of headers included; a direction with a smaller ``mtu_bytes`` counts.

    Raises:
        BadInput: with all problems found.

    Sources: RFC 9293 (handshake, segments, answers to what comes twice), RFC 6298 (timer), RFC 5681, section 3.2, and
    RFC 6582 (fast retransmission, partial acknowledgements).

    """

    window: int = 44
    give_up_s: float = 924.6
    open_at_start: bool = False
    mtu_bytes: int = 1500
    acknowledged: ClassVar[bool] = True
    in_order: ClassVar[bool] = True
    knows_dark: ClassVar[bool] = False
    timeout_s: ClassVar[float | None] = None
    tries: ClassVar[float] = math.inf

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        found: list[Problem] = []
        if not self.window >= 1:
            found.append(Problem("window", f"{self.window} segments on their way", "Give 1 or more."))
        if not self.give_up_s > 0.0:
            found.append(Problem("give_up_s", f"giving up after {self.give_up_s} s", "Give above zero, or inf."))
        if not HEADER_BYTES < self.mtu_bytes <= MTU_MAX_BYTES:
            hint = f"Give {HEADER_BYTES + 1} to {MTU_MAX_BYTES}."
            found.append(Problem("mtu_bytes", f"packets of {self.mtu_bytes} bytes", hint))
        if found:
            raise BadInput(tuple(found))

    def segment_bytes(self, out: DirectionSettings, back: DirectionSettings) -> int:
        """Most data in one segment.

        Raises:
            BadInput: a direction cuts packets so short that none holds the headers (and, on the way out, a byte), or
                charges TCP's headers already.

        """
        if found := (*tcp_problems(out, HEADER_BYTES + 1), *tcp_problems(back, HEADER_BYTES)):
            raise BadInput(found)
        room_bytes = out.mtu_bytes - out.header_bytes if out.mtu_bytes else self.mtu_bytes
        return min(self.mtu_bytes, room_bytes) - HEADER_BYTES


def least_packet_bytes(own: Delivery, other: Delivery) -> int:
    """Smallest TCP packet that a direction must carry, without the direction's header; 0: there is no TCP.

    Args:
        own: delivery of the direction's messages.
        other: of those that go the other way; the direction carries their acknowledgements.

    """
    if isinstance(own, Tcp):
        return HEADER_BYTES + 1
    return HEADER_BYTES if isinstance(other, Tcp) else 0


def tcp_problems(way: DirectionSettings, least_bytes: int) -> tuple[Problem, ...]:
    """Why a direction cannot carry TCP's packets, of which the smallest has ``least_bytes``."""
    found: list[Problem] = []
    if way.header_bytes >= HEADER_BYTES:
        what = f"{way.header_bytes} bytes and TCP's and IP's own {HEADER_BYTES}: these headers would be charged twice"
        found.append(Problem("header_bytes", what, "Give 0, or those of layers below IP; or choose another delivery."))
    elif 0 < way.mtu_bytes < way.header_bytes + least_bytes:
        what = f"fragments of {way.mtu_bytes} bytes hold no TCP segment"
        found.append(Problem("mtu_bytes", what, f"Give {way.header_bytes + least_bytes} or more, or 0."))
    return tuple(found)
