"""Store and forward with custody: a message is kept until the other site has taken it, through blackouts too.

The sender knows the schedules of both directions, as the operators of a deep-space link do. It offers nothing to a dark
link, and it does not wait for an acknowledgement longer or shorter than the schedules make it take.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from teleop_sim.channel.arq import (
    FRAME_BYTES,
    WINDOW_MAX,
    Delivery,
    crossing_s,
    frame_bits,
    margin_s,
    refuse,
    round_trip_s,
    timeout_for,
)
from teleop_sim.channel.blackouts import Schedule, first_light
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.rates import finish_of


@dataclass(frozen=True, slots=True)
class Custody:
    """Kept until acknowledged; copies go out in the light only; the application gets each message as it comes, once.

    Attributes:
        window: messages in the air at once, 1 to 32768; the others are kept too, but have not been sent yet.
        timeout_s: from the first bit of a copy to its acknowledgement; ``None``: ``ack_due_s`` of the message.
        tries: copies before giving up, at least 1; ``inf``, the default: never.

    Not modelled: a store that is full, bundles in parts, relays (each hop would be one more pair of endpoints).

    Source: custody transfer of the Bundle Protocol, RFC 5050 (2007), section 5.10; wire format and timer are ours.

    """

    window: int = WINDOW_MAX
    timeout_s: float | None = None
    tries: float = math.inf
    acknowledged: ClassVar[bool] = True
    in_order: ClassVar[bool] = False
    knows_dark: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse what cannot work.

        Raises:
            BadInput: with all problems found.

        """
        refuse(self.window, self.timeout_s, self.tries)


def start_s(delivery: Delivery, now_s: float, out: DirectionSettings) -> float:
    """When a copy that is due now may be offered to the link [s]: now, or at first light if the sender knows."""
    return first_light(now_s, out.blackouts) if delivery.knows_dark else now_s


def out_s(delivery: Delivery, turn_s: float, frame_bytes: int, out: DirectionSettings) -> float:
    """When the sender believes that a frame is out whose turn comes at ``turn_s`` [s]; ``inf``: never."""
    return _finish_s(turn_s, frame_bytes, out, out.blackouts if delivery.knows_dark else ())


def ack_due_s(turn_s: float, payload_bytes: int, out: DirectionSettings, back: DirectionSettings) -> float:
    """When the acknowledgement should have come of a copy whose turn comes at ``turn_s`` [s]; ``inf``: never.

    As ``timeout_for``, with the dark time of both directions added and its margin kept.
    """
    there_s = _finish_s(turn_s, payload_bytes + FRAME_BYTES, out, out.blackouts) + crossing_s(out)
    here_s = _finish_s(there_s, FRAME_BYTES, back, back.blackouts) + crossing_s(back)
    return here_s + margin_s(round_trip_s(out, back, payload_bytes))


def _finish_s(turn_s: float, frame_bytes: int, way: DirectionSettings, blackouts: Schedule) -> float:
    if math.isinf(turn_s):
        return turn_s
    rates = way.rates or ((0.0, way.rate_bps),)
    return finish_of(turn_s, frame_bits(way, frame_bytes), rates, blackouts)


def alarm_s(
    delivery: Delivery, turn_s: float, payload_bytes: int, out: DirectionSettings, back: DirectionSettings
) -> float:
    """When to worry about a copy whose turn comes at ``turn_s`` [s]; ``inf``: never."""
    if delivery.timeout_s is not None:
        return turn_s + delivery.timeout_s
    if delivery.knows_dark:
        return ack_due_s(turn_s, payload_bytes, out, back)
    return turn_s + timeout_for(out, back, payload_bytes)
