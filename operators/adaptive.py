"""Set the level of autonomy by what the link turns out to be and by how the behaviour fares."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

from teleop_sim.channel.messages import Message, SetLevel, SyncRequest
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.policies import Supervise

TOP = 3


@dataclass(frozen=True)
class Adaptive(Supervise):
    """As ``Supervise``, and the level follows link and failures. All figures are assumed.

    Each confirmation costs a round trip. So where one takes long, as seen from commands to their effects, the level
    goes up; where it is short, people look at more of what the robot does. After failures the level is one lower, so
    that somebody looks before the next one. A link that fell silent counts as slow, and the whole state is asked for.

    Attributes:
        slow_s: round trips from which the level is to be low, high, full, ascending; below the first it is off.
        margin: a level is kept while the round trip is within this factor of its bounds.
        fails, window_s: so many failures within so long lower the level by one.
        hold_s: between two changes, beyond the round trip.
        beats: heartbeats missed before the link counts as silent; without a heartbeat silence says nothing.

    """

    slow_s: tuple[float, float, float] = (0.0, 2.0, 10.0)
    margin: float = 1.25
    fails: int = 2
    window_s: float = 120.0
    hold_s: float = 30.0
    beats: int = 3

    def advise(self, belief: Belief, now_s: float, briefing: Briefing, /) -> tuple[Message, ...]:
        """``SetLevel``, and ``SyncRequest`` when nothing comes any more."""
        if self._silent(belief, now_s, briefing) and now_s >= self._free_s(belief, SyncRequest.topic, briefing):
            return (SyncRequest(),)
        if now_s < self._free_s(belief, SetLevel.topic, briefing):
            return ()
        level = self.level(belief, now_s, briefing)
        return () if level == belief.mirror.level else (SetLevel(level),)

    def wake_s(self, belief: Belief, now_s: float, briefing: Briefing, /) -> float:
        """When silence begins to tell, a failure is forgotten, or a change is free again."""
        times_s = [
            self._silent_from_s(belief, briefing),
            self._free_s(belief, SetLevel.topic, briefing),
            self._free_s(belief, SyncRequest.topic, briefing),
            *[t_s + self.window_s for t_s in belief.failed_s[-self.fails :]],
        ]
        return min([t_s for t_s in times_s if t_s > now_s], default=math.inf)

    def level(self, belief: Belief, now_s: float, briefing: Briefing) -> int:
        """The level that is wanted now, 0 to 3."""
        seen_s = briefing.round_trip_s if belief.trip_s is None else belief.trip_s
        trip_s = math.inf if self._silent(belief, now_s, briefing) else seen_s
        least, most = self._bound(trip_s / self.margin), self._bound(trip_s * self.margin)
        lately = [t_s for t_s in belief.failed_s if now_s - t_s < self.window_s]
        careful = 1 if len(lately) >= self.fails else 0
        return max(0, min(max(belief.mirror.level, least - careful), most - careful))

    def _bound(self, trip_s: float) -> int:
        return bisect_right(self.slow_s, trip_s)

    def _silent_from_s(self, belief: Belief, briefing: Briefing) -> float:
        return belief.heard_s + self.beats * briefing.heartbeat_s if briefing.heartbeat_s > 0.0 else math.inf

    def _silent(self, belief: Belief, now_s: float, briefing: Briefing) -> bool:
        return now_s >= self._silent_from_s(belief, briefing) + briefing.round_trip_s * (belief.heard_s == 0.0)

    def _free_s(self, belief: Belief, topic: str, briefing: Briefing) -> float:
        """From when something of a kind may be sent again."""
        sent = belief.sent.get(topic)
        return -math.inf if sent is None else sent[0] + briefing.round_trip_s + self.hold_s
