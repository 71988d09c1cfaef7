"""What an operator believes: made of what has arrived and of nothing else."""

from __future__ import annotations

from teleop_sim.channel.messages import Message, MirrorUpdate, Request
from teleop_sim.machines.declare import Edge, Machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.interventions import failed_state

_VERBS = {"manual": "help", "decide": "choose", "data": "give", "act": "act"}


class Belief:
    """The state of things as the operator knows them.

    Attributes:
        mirror: the machine's copy: present states, mode, level and open requests, as far as known.
        visited: states seen, oldest first, the present one last; a state that repeats itself counts once.
        helped: failed state of every intervention so far, oldest first.

    """

    def __init__(self, mirror: Mirror) -> None:
        self.mirror = mirror
        self.visited: tuple[str, ...] = mirror.states
        self.helped: tuple[str, ...] = ()

    @property
    def machine(self) -> Machine:
        """The machine's table."""
        return self.mirror.machine

    def take(self, message: Message) -> Edge | None:
        """Remember what a message, which the mirror has taken, says; returns the transition that it told of, if any."""
        table = self.machine.table
        if isinstance(message, MirrorUpdate) and message.edge < len(table) and self.mirror.stranger is None:
            edge = table[message.edge]
            # A lost update leaves a gap: the edge itself says where the machine must have been.
            self._visit((edge.state, *self._entered(edge)))
            return edge
        if not set(self.visited[-1:]) & set(self.mirror.states):
            self._visit(self.mirror.states)
        return None

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
