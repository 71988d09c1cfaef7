"""A run's link on the clock: two endpoints, the directions between them, and rates that follow the robot's machine."""

from __future__ import annotations

from collections.abc import Callable

import simpy

from teleop_sim.channel.delivery import Connection, Endpoint, connect
from teleop_sim.channel.fates import Fate, Tell
from teleop_sim.channel.link import Direction, Receive
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.message_ends import message_ended
from teleop_sim.core.records import Emit, Record, TransitionTaken
from teleop_sim.scenarios.links import LinkPlan, Streams, WayPlan

Send = Callable[[str, bytes, str], None]
"""What a site holds of the link: topic, payload, and a remark for the log."""


def wire(
    env: simpy.Environment, plan: LinkPlan, streams: Streams, to_field: Receive, to_station: Receive, emit: Emit
) -> Connection:
    """The link between two sites.

    Args:
        env: the clock.
        plan: what the link can do.
        streams: loss and jitter are drawn from ``link.up`` and ``link.down``.
        to_field: told of each message that arrives at the field site. to_station: at the control station.
        emit: told of each packet's end, and of each message's where its delivery acknowledges.

    """

    def make(name: DirectionName, receive: Receive, seen: Emit) -> Direction:
        settings = plan.up.settings if name == "up" else plan.down.settings
        return Direction(env, name, settings, receive, seen, streams(f"link.{name}"))

    def end(name: DirectionName, way: WayPlan, receive: Receive) -> Endpoint:
        tell = _teller(env, name, way, emit)
        return Endpoint(env, way.delivery, receive, tell, ack_priority=way.priorities.get("ack", 0))

    station, site = end("up", plan.up, to_station), end("down", plan.down, to_field)
    return connect(make, station, site, emit)


def _teller(env: simpy.Environment, name: DirectionName, way: WayPlan, emit: Emit) -> Tell:
    """What records the fates of a direction's messages. With best effort the packets' records say it all."""

    def tell(fate: Fate) -> None:
        if way.delivery.acknowledged:
            emit(message_ended(fate, float(env.now), name, way.settings.blackouts))

    return tell


def sender(endpoint: Endpoint, way: WayPlan) -> Send:
    """What a site sends with: each message as urgent as its topic."""

    def send(topic: str, payload: bytes, text: str = "") -> None:
        endpoint.send(topic, payload, text, way.priorities.get(topic, 0))

    return send


def rates_by_state(plan: LinkPlan, link: Connection, emit: Emit) -> Emit:
    """An ``emit`` for the field site that switches rates when its machine enters a state.

    The organisers' shaper does this, not a site: they know which part of the task is on.
    """
    ways = [(d, way) for d, way in ((link.up, plan.up), (link.down, plan.down)) if way.rate_of_state]

    def seen(record: Record) -> None:
        emit(record)
        if isinstance(record, TransitionTaken):
            for direction, way in ways:
                direction.switch_rate(way.rate_in(record.next_state))

    return seen if ways else emit
