"""Two endpoints and the link between them, with everything that happens kept: set-up of the tests of deliveries."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
import simpy

from teleop_sim.channel.delivery import BestEffort, Connection, Endpoint, Fate, connect
from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import NoLoss
from teleop_sim.core.records import PacketEnded, Record

SRC_UP, SRC_DOWN = DirectionSettings(64.0, 10.0), DirectionSettings(50_000.0, 10.0)


@dataclass
class Site:
    """One site's application: what it sent, got and was told, and when; and the fates of what it sent."""

    sent: list[bytes] = field(default_factory=list)
    got: list[tuple[float, bytes]] = field(default_factory=list)
    news: list[tuple[float, int, bool]] = field(default_factory=list)
    fates: list[Fate] = field(default_factory=list)

    @property
    def payloads(self) -> list[bytes]:
        return [data for _, data in self.got]


@dataclass
class Talk:
    """``station`` sends ``up``, ``site`` sends ``down``; most tests look at the station's messages."""

    env: simpy.Environment = field(default_factory=simpy.Environment)
    station: Site = field(default_factory=Site)
    site: Site = field(default_factory=Site)
    records: list[Record] = field(default_factory=list)
    link: Connection = None

    @property
    def got(self):
        return self.site.got

    @property
    def fates(self):
        return self.station.fates

    @property
    def news(self):
        return self.station.news

    @property
    def packets(self):
        return [r for r in self.records if isinstance(r, PacketEnded)]

    def sent(self, direction, topic=None):
        """When packets of a direction (and topic) were offered, in order."""
        return [p.sent_s for p in self.numbered(direction) if topic in (None, p.topic)]

    def numbered(self, direction):
        return sorted((p for p in self.packets if p.direction == direction), key=lambda p: p.packet)

    def until(self, t_s=None):
        self.env.run(until=t_s)
        self.link.close()
        return self


class These:
    """A loss model: the fragments with these indices, in order of sending."""

    mean_loss = 0.0

    def __init__(self, *indices):
        self.indices = indices
        self.count = itertools.count()

    def step(self, bad, _):
        return bad, next(self.count) in self.indices


def between(ways, deliveries, seed=5, ack_priority=0):
    """Two endpoints over ``ways`` (up, down) with their ``deliveries``; the site's acknowledgements have a priority."""
    talk = Talk()
    settings = dict(zip(("up", "down"), ways, strict=True))
    streams = dict(zip(settings, np.random.default_rng(seed).spawn(2), strict=True))

    def make(name, receive, emit):
        return Direction(talk.env, name, settings[name], receive, emit, streams[name])

    def endpoint(mine, delivery, priority):
        return Endpoint(
            talk.env,
            delivery,
            lambda data: mine.got.append((talk.env.now, data)),
            mine.fates.append,
            lambda number, ok: mine.news.append((talk.env.now, number, ok)),
            priority,
        )

    ends = endpoint(talk.station, deliveries[0], 0), endpoint(talk.site, deliveries[1], ack_priority)
    talk.link = connect(make, *ends, talk.records.append)
    return talk


def story(delivery, up=SRC_UP, down=SRC_DOWN, lose_up=None, lose_down=None, back=None, seed=5, ack_priority=0):
    """The station sends by ``delivery``; what is lost each way is a loss model."""
    ways = replace(up, loss=lose_up or NoLoss()), replace(down, loss=lose_down or NoLoss())
    return between(ways, (delivery, back or BestEffort()), seed, ack_priority)


def converse(ways, deliveries, sends, until_s, seed):
    """Play ``(t_s, name, size_bytes)`` over a connection; the first two bytes of a payload make it unlike others."""
    talk = between(ways, deliveries, seed)
    ends = {"up": (talk.station, talk.link.station), "down": (talk.site, talk.link.site)}

    def speak():
        for t_s, name, size in sends:
            yield talk.env.timeout(t_s - talk.env.now)
            mine, end = ends[name]
            mine.sent.append(len(mine.sent).to_bytes(2, "big") + b"." * size)
            assert end.send("chat", mine.sent[-1]) == len(mine.sent) - 1

    talk.env.process(speak())
    return talk.until(until_s)
