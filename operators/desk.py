"""What the people at a control station share: screens, uplink, agreements, and each other's ears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, cast, runtime_checkable

import numpy as np

from teleop_sim.channel.messages import Message, Request, RequestKind
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.sync import Asked
from teleop_sim.operators.acts import Briefing, Send
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.deeds import Deeds
from teleop_sim.operators.guide import Check
from teleop_sim.operators.memo import FreshEyes
from teleop_sim.operators.policies import Policy
from teleop_sim.operators.roles import Role, role_of
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.operators.verification import CRITERION

if TYPE_CHECKING:
    from teleop_sim.operators.inbox import Inbox
    from teleop_sim.operators.person import Person


class Giver(Protocol):
    """How a request for data is met, such as by fitting a template to the cloud that has arrived."""

    def work_s(self, belief: Belief, request: Request, timing: OperatorTiming) -> float:
        """Mean time that it takes [s]."""
        ...

    def give(self, belief: Belief, request: Request, rng: np.random.Generator) -> tuple[Message, ...]:
        """What is sent, the answer last; empty: nothing can be given before another view has arrived."""
        ...


@runtime_checkable
class Wanting(Protocol):
    """A giver who may have to ask for something first."""

    def wants(self, belief: Belief) -> Message | None:
        """What is to be asked for before anything can be given; None: nothing."""
        ...


def wanted(giver: object, belief: Belief) -> Message | None:
    """What a giver has to ask for first; None: nothing, or it never asks."""
    return giver.wants(belief) if isinstance(giver, Wanting) else None


class Hands(Protocol):
    """What people do by hand, piece by piece."""

    def check(self, belief: Belief, request: Request) -> Check:
        """What somebody is to look at before a request is answered; empty: nothing."""
        ...

    def checking(self, belief: Belief, request: Request, what: Check, rng: np.random.Generator) -> Deeds:
        """Look at it; whether all is well."""
        ...

    def doing(self, belief: Belief, request: Request, rng: np.random.Generator) -> Deeds:
        """Do what the state that asks does."""
        ...


@dataclass
class Desk:
    """What is shared.

    Attributes:
        belief: what has arrived; all screens show the same.
        send: to the uplink.
        briefing: what the crew was told beforehand.
        policy: what the crew has agreed on.
        givers: who meets requests for data, by what ViGIR's states ask for (parameter ``request``).
        criterion: evidence above which who verifies rejects a claim.
        hands: how work in lieu of a state is done, piece by piece; None: as the policy moves a hand.
        seats: who has which role.
        eyes: how a claim is judged, worked out or remembered.

    """

    belief: Belief
    send: Send
    briefing: Briefing
    policy: Policy
    givers: Mapping[str, Giver] = field(default_factory=dict)
    criterion: float = CRITERION
    hands: Hands | None = None
    seats: dict[Role, Person] = field(default_factory=dict)
    eyes: FreshEyes = field(default_factory=FreshEyes)
    _machine: Machine | None = field(default=None, init=False, repr=False)
    _roles: dict[tuple[str, int], Role] = field(default_factory=dict, init=False, repr=False)
    _opened: dict[Asked, Request] = field(default_factory=dict, init=False, repr=False)

    def role(self, request: Request) -> Role:
        """Who answers it (``role_of``), looked up once for each state and kind of request."""
        machine, asked = self.belief.machine, (request.kind, request.node)
        if machine is not self._machine:
            self._machine, self._roles = machine, {}
        if asked not in self._roles:
            self._roles[asked] = role_of(machine, request)
        return self._roles[asked]

    def opened(self, asked: Asked) -> tuple[Request, Role]:
        """A request that the mirror shows, the same for everybody, and whose it is."""
        request = self._opened.get(asked)
        if request is None:
            kind = cast(RequestKind, asked.kind)
            request = self._opened[asked] = Request(asked.request, kind, asked.node, asked.edge)
        return request, self.role(request)

    def giver(self, request: Request) -> Giver | None:
        """Who meets this request for data."""
        if request.kind != "data":
            return None
        state = self.belief.machine.leaf(self.belief.path_of(request))
        return self.givers.get(str(dict(state.parameters).get("request", "")))


@dataclass(frozen=True)
class Order:
    """What one person has worked out and another is to send."""

    request: Request
    messages: tuple[Message, ...]


@dataclass(frozen=True)
class Errand:
    """Before a request is answered, somebody is to see to something, for whoever answers it."""

    request: Request
    what: Check
    asker: Inbox

    @property
    def said(self) -> str:
        """How it is asked for."""
        return "reset the world model" if self.what == "world" else f"check {self.what}"

    def told(self, well: bool) -> str:
        """What is reported, if all was well or not."""
        if self.what == "world":
            return "the world model is reset"
        return f"{self.what} {'fits' if well else 'was off'}"
