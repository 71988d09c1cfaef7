"""The fate of a message as the log has it: its waits told apart as those of a packet are."""

from __future__ import annotations

import math

from teleop_sim.channel.blackouts import Schedule, dark_between
from teleop_sim.channel.fates import Fate
from teleop_sim.channel.message import DirectionName
from teleop_sim.core.records import MessageEnded


def message_ended(fate: Fate, t_s: float, direction: DirectionName, blackouts: Schedule) -> MessageEnded:
    """The record of a message.

    The waits are those of the copy that arrived, with every time that the delivery adds: ``retransmission_s`` has the
    time from the first copy to that one; ``queue_s`` also the light time in which the sender kept the message back (a
    handshake, a full window), ``blackout_s`` the dark one; ``propagation_s`` also what the receiver waited for, other
    messages or other parts. What was sent of a message that its sender gave up was sent in vain.

    Args:
        fate: of the message.
        t_s: now; a message may have been given up before, while its last copy was on its way.
        direction: in which it went.
        blackouts: of that direction.

    """
    delivered, given_up = fate.outcome == "delivered", fate.outcome == "gave_up"
    queue_s, blackout_s, serialisation_s, propagation_s, vain_s = _waits(fate, blackouts)
    return MessageEnded(
        t_s=t_s,
        direction=direction,
        number=fate.number,
        topic=fate.topic,
        payload_bytes=fate.payload_bytes,
        sent_s=fate.offered_s,
        delivered_s=fate.ended_s if delivered else math.nan,
        queue_s=queue_s,
        blackout_s=blackout_s,
        serialisation_s=serialisation_s,
        propagation_s=propagation_s,
        retransmission_s=vain_s,
        copies=fate.tries,
        outcome="dropped" if given_up else fate.outcome,
        reason=fate.reason,
        text=fate.text,
    )


def _waits(fate: Fate, blackouts: Schedule) -> tuple[float, float, float, float, float]:
    """Queue, blackout, serialisation, propagation, retransmission [s]; they add up to the four of the fate."""
    dark_s = dark_between(fate.offered_s, fate.offered_s + fate.store_s, blackouts)
    # A difference of times: rounding may leave a hair below zero.
    kept_s = max(0.0, fate.store_s - dark_s)
    packet = fate.record
    if packet is None or packet.outcome == "dropped" or fate.outcome == "gave_up":
        return kept_s, dark_s, 0.0, fate.order_s, fate.retransmission_s + fate.link_s
    held_s = fate.order_s
    if fate.outcome == "in_flight" and packet.outcome == "delivered":
        # This part has arrived, another has not.
        held_s += max(0.0, fate.link_s - (packet.arrived_s - packet.sent_s))
    return (
        kept_s + packet.queue_s,
        dark_s + packet.blackout_s,
        packet.serialisation_s,
        held_s + packet.propagation_s,
        fate.retransmission_s + packet.retransmission_s,
    )
