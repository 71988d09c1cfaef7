"""What an operator believes: made of what has arrived and of nothing else."""

from __future__ import annotations

from teleop_sim.channel.messages import MODES, LevelIs, Message, MirrorUpdate, ModeIs, Request
from teleop_sim.machines.declare import Edge
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.interventions import failed_state


class Belief:
    """The state of things as the operator knows them.

    Attributes:
        mirror: the machine's copy: present state, mode, level and open request, as far as known.
        machine: the machine's table.
        visited: states seen, oldest first, the present one last; a state that repeats itself counts once.
        helped: failed state of every intervention so far, oldest first.

    """

    def __init__(self, mirror: Mirror) -> None:
        self.mirror = mirror
        self.machine = mirror.machine
        self.visited: tuple[str, ...] = (mirror.machine.start,)
        self.helped: tuple[str, ...] = ()

    def take(self, message: Message) -> Edge | None:
        """Change the belief by a message; returns the transition that it told of, if any."""
        match message:
            case MirrorUpdate(edge=index):
                self.mirror.apply(index)
                return self._follow(self.machine.edges[index]) if index < len(self.machine.edges) else None
            case ModeIs(mode=index):
                self.mirror.mode_is(MODES[index])
            case LevelIs(level=level):
                self.mirror.level_is(level)
            case Request(request=number, kind=kind, state=state, event=event):
                asked = self.machine.events[event] if kind == "confirm" else ""
                self.mirror.request(number, kind, self.machine.state_names[state], asked)
            case _:
                pass
        return None

    def question(self, request: Request) -> str:
        """What the console shows for a request, put together from the machine's table."""
        state = self.machine.state_names[request.state].removeprefix("STATE_")
        return f"{state} {self.machine.events[request.event]}" if request.kind == "confirm" else f"help {state}"

    def waiting_state(self, request: Request) -> str:
        """The state that is left when the request is settled.

        A request for help may name the state that failed instead of the one that waits for a person.
        """
        named = self.machine.states[request.state]
        if request.kind == "confirm" or named.manual:
            return named.name
        return next((state.name for state in self.machine.states if state.manual), named.name)

    def note_help(self) -> None:
        """Remember that an intervention was made for the state that failed."""
        self.helped = (*self.helped, failed_state(self.machine, self.visited))

    def _follow(self, edge: Edge) -> Edge:
        # A lost update leaves a gap: the edge itself says where the machine must have been.
        for state in (edge.state, edge.next_state):
            if state != self.visited[-1]:
                self.visited = (*self.visited, state)
        return edge
