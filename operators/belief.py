"""What an operator believes: made of what has arrived and of nothing else."""

from __future__ import annotations

import zlib

from teleop_sim.channel.messages import Image, Marks, Message, MirrorUpdate, Request
from teleop_sim.machines.declare import Edge, Machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.interventions import failed_state
from teleop_sim.operators.verification import Judgement

_VERBS = {"manual": "help", "decide": "choose", "data": "give", "act": "act"}


class Belief:
    """The state of things as the operator knows them.

    Attributes:
        mirror: the machine's copy: present states, mode, level and open requests, as far as known.
        visited: states seen, oldest first, the present one last; a state that repeats itself counts once.
        helped: failed state of every intervention so far, oldest first.
        judged: what was made of the claims that requests ask about, by request.
        refused: how often in a row each outcome, by its place in the table, was refused.

    """

    def __init__(self, mirror: Mirror) -> None:
        self.mirror = mirror
        self.visited: tuple[str, ...] = mirror.states
        self.helped: tuple[str, ...] = ()
        self.judged: dict[int, Judgement] = {}
        self.refused: dict[int, int] = {}
        self._picture: Image | None = None
        self._claims: dict[int, tuple[Image, Marks]] = {}

    @property
    def machine(self) -> Machine:
        """The machine's table."""
        return self.mirror.machine

    def take(self, message: Message) -> Edge | None:
        """Remember what a message, which the mirror has taken, says; returns the transition that it told of, if any."""
        table = self.machine.table
        self._look(message)
        if isinstance(message, MirrorUpdate) and message.edge < len(table) and self.mirror.stranger is None:
            edge = table[message.edge]
            self.refused.pop(message.edge, None)
            # A lost update leaves a gap: the edge itself says where the machine must have been.
            self._visit((edge.state, *self._entered(edge)))
            return edge
        if not set(self.visited[-1:]) & set(self.mirror.states):
            self._visit(self.mirror.states)
        return None

    def shown(self, request: Request) -> tuple[Image, Marks] | None:
        """The picture and the marks that belong to the outcome which a request asks about, if both have arrived."""
        return self._claims.get(request.edge)

    def note_judgement(self, request: Request, judgement: Judgement | None) -> None:
        """Remember what was made of a claim. A picture serves once: the next look brings its own."""
        self._claims.pop(request.edge, None)
        if judgement is not None:
            self.judged[request.request] = judgement

    def note_refusal(self, request: Request) -> None:
        """Remember that an outcome was refused."""
        self.refused[request.edge] = self.refused.get(request.edge, 0) + 1

    def _look(self, message: Message) -> None:
        if isinstance(message, Image):
            self._picture = message
        elif isinstance(message, Marks):
            self._claims.pop(message.edge, None)
            if self._picture is not None and zlib.crc32(self._picture.coded) == message.picture:
                self._claims[message.edge] = (self._picture, message)

    def question(self, request: Request) -> str:
        """What the console shows for a request, put together from the machine's table."""
        state = self._path(request).removeprefix("STATE_")
        if request.kind == "confirm":
            return f"{state} {self.machine.table[request.edge].event}"
        return f"{_VERBS[request.kind]} {state}"

    def waiting_state(self, request: Request) -> str:
        """The state that is left when the request is settled.

        A request for help may name the state that failed instead of the one that waits for a person.
        """
        named = self._path(request)
        if request.kind != "manual" or self.machine.leaf(named).manual:
            return named
        return next((path for path in self.machine.state_names if self.machine.leaf(path).manual), named)

    def is_at(self, request: Request) -> bool:
        """Is the machine where the request comes from, as far as known?"""
        return self.machine.net.on_path(self.mirror.snapshot.configuration, request.node)

    def note_help(self) -> None:
        """Remember that an intervention was made for the state that failed."""
        self.helped = (*self.helped, failed_state(self.machine, self.visited))

    def _path(self, request: Request) -> str:
        return self.machine.net.nodes[request.node].path

    def _entered(self, edge: Edge) -> tuple[str, ...]:
        inside = (s for s in self.mirror.states if s == edge.next_state or s.startswith(f"{edge.next_state}/"))
        return tuple(inside) or self.mirror.states

    def _visit(self, states: tuple[str, ...]) -> None:
        for state in states:
            if (state,) != self.visited[-1:]:
                self.visited = (*self.visited, state)
