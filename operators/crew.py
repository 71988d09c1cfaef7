"""One to four people at the control station, and its software: the same screens, one uplink, talk across the room."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import simpy

from teleop_sim.channel.messages import TemplateHash, TemplateState, encode_message
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.core.records import Emit
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.acts import Briefing, Process, Send
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.desk import Desk, Giver, Hands
from teleop_sim.operators.human import Human
from teleop_sim.operators.memo import FreshEyes
from teleop_sim.operators.person import Person
from teleop_sim.operators.policies import Policy, Supervise
from teleop_sim.operators.roles import TEAMS
from teleop_sim.operators.station import Station
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.operators.verification import CRITERION


class Crew:
    """Sees only ``receive``, acts only by ``send``.

    Args:
        env: the clock.
        mirror: the machine's copy.
        send: to the uplink.
        timing, human: how long each of them takes, and what goes wrong.
        rng: keys their random streams.
        emit: to the log.
        briefing: what they were told about the link.
        policy: what they have agreed on; default ``Supervise``.
        team: how many they are, 1 to 4 (``roles.TEAMS``).
        givers: how requests for data are met. templates: the station's server, which its software keeps in step.
        criterion: evidence above which who verifies rejects a claim, in standard deviations.
        hands: how they work through a template by hand, and what they check; None: nobody does.
        eyes: how a claim is judged: worked out (default) or remembered.

    Attributes:
        belief: what has arrived.
        people: in the order of ``roles.TEAMS``; the first is the supervisor.

    """

    def __init__(
        self,
        env: simpy.Environment,
        mirror: Mirror,
        send: Send,
        timing: OperatorTiming,
        rng: np.random.Generator,
        emit: Emit,
        briefing: Briefing,
        policy: Policy | None = None,
        team: int = 1,
        human: Human | None = None,
        givers: Mapping[str, Giver] | None = None,
        templates: StationTemplates | None = None,
        criterion: float = CRITERION,
        hands: Hands | None = None,
        eyes: FreshEyes | None = None,
    ) -> None:
        self._env, self.belief, self._send, self._templates = env, Belief(mirror), send, templates
        self.belief.work.in_reach = briefing.in_reach
        key = tuple(int(k) for k in rng.integers(2**32, size=4))
        self._station = Station(env, mirror, send, briefing.heartbeat_s + briefing.round_trip_s)
        desk = Desk(self.belief, send, briefing, policy or Supervise(), givers or {}, criterion, hands)
        desk.eyes = eyes or desk.eyes
        self.people = tuple(
            Person(env, desk, timing, human or Human(), key, seat, emit, roles)
            for seat, roles in enumerate(TEAMS[team])
        )
        desk.seats |= {role: person for person in self.people for role in person.roles}

    def receive(self, payload: bytes) -> None:
        """Take what the downlink delivered. All displays change at once; the rest waits for attention."""
        message = self._station.receive(payload)
        if self._templates is not None and isinstance(message, (TemplateState, TemplateHash)):
            reply = self._templates.receive(message, float(self._env.now))
            if reply is not None:
                self._send(*encode_message(reply), "templates out of step")
        self.belief.take(message, float(self._env.now))
        for person in self.people:
            person.notice(message)

    def run(self) -> Process:
        """Process: never ends."""
        self._station.begin()
        for person in self.people[1:]:
            self._env.process(person.run())
        yield from self.people[0].run()
