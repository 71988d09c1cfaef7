"""Automatic repeat request: frames on the wire, time-outs, and two deliveries made of them.

A frame is a flag byte that says what it is, a number of two bytes (big-endian) and, in data, the payload. The link is
charged for all of it.

State that a real implementation would hold: the sender two numbers (4 bytes), and for each message in its window the
payload, a try and an alarm (payload + 10 bytes); the receiver one number (2 bytes), and for each message held back its
payload and number (payload + 2 bytes), at most a window of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.core.errors import BadInput, Problem

PLAIN, DATA, ACK, SKIP = range(4)
"""What a frame is: a payload that nobody acknowledges, one that is, its acknowledgement, a number given up."""

FRAME_BYTES = 3
_NUMBERS = 1 << 16
WINDOW_MAX = _NUMBERS // 2
"""A wider window would make a new number look like an old one (Bertsekas & Gallager, section 2.4.3)."""

_MARGIN, _MARGIN_MIN_S = 0.1, 0.01


@dataclass(frozen=True, slots=True)
class Frame:
    """What crosses: ``number`` as it fits on the wire, 0 to 65535."""

    kind: int
    number: int = 0
    payload: bytes = b""

    def pack(self) -> bytes:
        """Bytes on the wire; a plain frame has no number."""
        return bytes((self.kind,)) + (b"" if self.kind == PLAIN else self.number.to_bytes(2, "big")) + self.payload


def unpack_frame(data: bytes) -> Frame:
    """Inverse of ``Frame.pack``.

    Raises:
        BadMessage: the bytes are no frame.

    """
    kind = data[0] if data else -1
    if kind == PLAIN:
        return Frame(PLAIN, payload=data[1:])
    if kind not in (DATA, ACK, SKIP) or len(data) < FRAME_BYTES or (kind != DATA and len(data) > FRAME_BYTES):
        hint = "Both ends of a link must be told the same deliveries."
        raise BadMessage("frame", f"{len(data)} bytes that start with {data[:3].hex() or 'nothing'}", hint)
    return Frame(kind, int.from_bytes(data[1:3], "big"), data[3:])


def frame_bits(settings: DirectionSettings, frame_bytes: int) -> int:
    """Bits of a frame with all headers, cut as the link cuts it."""
    return sum(settings.framing.fragments(frame_bytes))


def serialisation_s(settings: DirectionSettings, frame_bytes: int) -> float:
    """How long a frame occupies an idle, light transmitter, at the slowest of its rates [s]."""
    slowest_bps = min((rate_bps for _, rate_bps in settings.rates), default=settings.rate_bps)
    return frame_bits(settings, frame_bytes) / slowest_bps


def crossing_s(settings: DirectionSettings) -> float:
    """The longest way across [s]. A jitter is taken to reach as far above its mean as below."""
    return settings.longest_delay_s + 2.0 * settings.jitter.mean_s - settings.jitter.least_s


def round_trip_s(out: DirectionSettings, back: DirectionSettings, payload_bytes: int) -> float:
    """From the first bit of a message to its acknowledgement on an idle, light link [s], at the longest."""
    there_s = serialisation_s(out, payload_bytes + FRAME_BYTES) + crossing_s(out)
    return there_s + serialisation_s(back, FRAME_BYTES) + crossing_s(back)


def margin_s(round_s: float) -> float:
    """What a time-out adds to a round trip: a tenth, at least 10 ms (assumed)."""
    return max(_MARGIN * round_s, _MARGIN_MIN_S)


def timeout_for(out: DirectionSettings, back: DirectionSettings, payload_bytes: int) -> float:
    """How long to wait for an acknowledgement, counted from the first bit of the data [s].

    Data out, across, acknowledgement out, across; and a margin for what cannot be known, such as traffic of the other
    site ahead of the acknowledgement. It knows no blackout. At 64 bit/s up, 50 kbit/s down and 10 s each way, 18 bytes
    have 24.9 s.
    """
    round_s = round_trip_s(out, back, payload_bytes)
    return round_s + margin_s(round_s)


class Delivery(Protocol):
    """How the messages of one sender get across: data that both sites are told."""

    @property
    def acknowledged(self) -> bool:
        """Whether the receiver answers; if not, the rest is not asked."""

    @property
    def in_order(self) -> bool:
        """Whether the application waits for a missing message, or gets each as it comes."""

    @property
    def knows_dark(self) -> bool:
        """Whether the sender looks into the schedule of blackouts (``custody.py``)."""

    @property
    def window(self) -> int:
        """Messages that may be on their way at once."""

    @property
    def timeout_s(self) -> float | None:
        """From the first bit of a copy to its acknowledgement; ``None``: computed for each message."""

    @property
    def tries(self) -> float:
        """Copies before the sender gives up; may be ``inf``."""


@dataclass(frozen=True, slots=True)
class StopAndWait:
    """One message on its way: repeated until acknowledged or given up, then the next. In order.

    Attributes:
        timeout_s: from the first bit of a copy to its acknowledgement; ``None``: ``timeout_for`` of the message.
        tries: copies before giving up, at least 1; ``inf``: never (8 is assumed).

    It knows no blackout: copies pile up in front of a dark link, and tries are used up.

    Source: Bertsekas and Gallager, Data Networks, 2nd ed. (1992), section 2.4.1.

    """

    timeout_s: float | None = None
    tries: float = 8
    acknowledged: ClassVar[bool] = True
    in_order: ClassVar[bool] = True
    knows_dark: ClassVar[bool] = False
    window: ClassVar[int] = 1

    def __post_init__(self) -> None:
        """Refuse what cannot work.

        Raises:
            BadInput: with all problems found.

        """
        refuse(1, self.timeout_s, self.tries)


@dataclass(frozen=True, slots=True)
class SelectiveRepeat:
    """Up to ``window`` messages on their way; each is acknowledged, and repeated, on its own. In order.

    Attributes:
        window: 1 to 32768 (64 is assumed). The link stays full if it is at least ``window_for``.
        timeout_s: from the first bit of a copy to its acknowledgement; ``None``: ``timeout_for`` of the message.
        tries: copies before giving up, at least 1; ``inf``: never (8 is assumed).

    A number that is given up is announced by a skip frame of three bytes, so that later messages get through. It is
    repeated until it is acknowledged; after 64 copies it rests until there is a new message or acknowledgement. It
    knows no blackout: copies pile up in front of a dark link, and tries are used up.

    Source: Bertsekas and Gallager, Data Networks, 2nd ed. (1992), section 2.4.3; the skip after RFC 3758.

    """

    window: int = 64
    timeout_s: float | None = None
    tries: float = 8
    acknowledged: ClassVar[bool] = True
    in_order: ClassVar[bool] = True
    knows_dark: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Refuse what cannot work.

        Raises:
            BadInput: with all problems found.

        """
        refuse(self.window, self.timeout_s, self.tries)


def window_for(out: DirectionSettings, back: DirectionSettings, payload_bytes: int) -> int:
    """Messages of one size on their way that just keep a link without loss full; at most 32768.

    A place in the window is free again one serialisation, two delays and one acknowledgement after its message's
    turn; by then the whole window must not be out (Bertsekas and Gallager, section 2.4.2).
    """
    data_s = serialisation_s(out, payload_bytes + FRAME_BYTES)
    if data_s == 0.0:
        return WINDOW_MAX
    return min(WINDOW_MAX, math.ceil(round_trip_s(out, back, payload_bytes) / data_s))


def refuse(window: int, timeout_s: float | None, tries: float) -> None:
    """Check what all deliveries with acknowledgements share.

    Raises:
        BadInput: with all problems found.

    """
    found: list[Problem] = []
    if not 1 <= window <= WINDOW_MAX:
        hint = f"Give 1 to {WINDOW_MAX}: half of what two bytes number."
        found.append(Problem("window", f"{window} messages on their way", hint))
    if timeout_s is not None and not (math.isfinite(timeout_s) and timeout_s > 0.0):
        found.append(Problem("timeout_s", f"a time-out of {timeout_s} s", "Give above zero, or nothing."))
    if not tries >= 1 or (math.isfinite(tries) and tries != int(tries)):
        found.append(Problem("tries", f"{tries} tries", "Give a whole number from 1, or inf."))
    if found:
        raise BadInput(tuple(found))
