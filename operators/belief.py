"""What an operator believes: made of what has arrived and of nothing else."""

from __future__ import annotations

import math
import zlib

from teleop_sim.channel.messages import (
    Answer,
    Chat,
    Confirm,
    Force,
    HandBack,
    HandlePose,
    Image,
    JointState,
    Marks,
    Message,
    MirrorUpdate,
    Reject,
    Request,
    VoxelCloud,
    WebpImage,
)
from teleop_sim.machines.declare import Edge, Machine
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.sync import Snapshot
from teleop_sim.operators.at_work import TOLD, AtWork, walks
from teleop_sim.operators.interventions import failed_state
from teleop_sim.operators.verification import Judgement

VIEWS = frozenset({Image, WebpImage, VoxelCloud, HandlePose, JointState})
"""What shows the robot or its surroundings as they were when it was sent."""

ANSWERS = (Answer, Chat, Confirm, Force, HandBack, Reject)
"""What ends a request, so that the time until it is gone is a round trip."""

_GAIN = 0.125
"""Weight of a new round trip in the smoothed one: RFC 6298, 2.3."""

_VERBS = {"manual": "help", "decide": "choose", "data": "give", "act": "act"}


class Belief:
    """The state of things as the operator knows them.

    Attributes:
        mirror: the machine's copy: present states, mode, level and open requests, as far as known.
        visited: states seen, oldest first, the present one last; a state that repeats itself counts once.
        helped: failed state of every intervention so far, oldest first.
        heard_s: when the last message arrived.
        views: by topic, when the last picture, cloud or pose arrived, and what it was.
        failed: by state, how often it failed in a row, as far as seen.
        failed_s: when failures were seen, oldest first.
        trip_s: round trip from a command to its effect, smoothed as RFC 6298 does it; None: none was seen yet.
        sent: by topic, when something that nobody asked for was last sent, and what it was.
        in_lieu: by state, how often it was done by hand.
        moves: by request, how many movements by hand were made for it.
        judged: what was made of the claims that requests ask about, by request.
        refused: how often in a row each outcome, by its place in the table, was refused.
        work: what has arrived of work with a template.

    """

    def __init__(self, mirror: Mirror) -> None:
        self.mirror = mirror
        self.visited: tuple[str, ...] = mirror.states
        self._placed: Snapshot | None = None
        self.helped: tuple[str, ...] = ()
        self.heard_s = 0.0
        self.views: dict[str, tuple[float, Message]] = {}
        self.failed: dict[str, int] = {}
        self.failed_s: tuple[float, ...] = ()
        self.trip_s: float | None = None
        self.sent: dict[str, tuple[float, Message]] = {}
        self.in_lieu: dict[str, int] = {}
        self.moves: dict[int, int] = {}
        self._answered: dict[int, float] = {}
        self._timed: Snapshot | None = None
        self.judged: dict[int, Judgement] = {}
        self.refused: dict[int, int] = {}
        self.work = AtWork()
        self._since_s = 0.0
        self._picture: Image | None = None
        self._claims: dict[int, tuple[Image, Marks]] = {}

    @property
    def machine(self) -> Machine:
        """The machine's table."""
        return self.mirror.machine

    def take(self, message: Message, now_s: float = 0.0) -> Edge | None:
        """Remember what a message, which the mirror has taken, says; returns the transition that it told of, if any."""
        kind, self.heard_s = type(message), now_s
        if kind in VIEWS:
            self.views[message.topic] = now_s, message
        if self._answered and self._timed is not self.mirror.snapshot:
            self._time_trips(now_s)
        if kind is Image or kind is Marks:
            self._look(message)
        if kind in TOLD:
            self.work.take(message, now_s, self.mirror.states)
        if type(message) is MirrorUpdate and message.edge < len(self.machine.table) and self.mirror.stranger is None:
            return self._went(message.edge, now_s)
        if self._placed is not self.mirror.snapshot:
            self._placed, states = self.mirror.snapshot, self.mirror.states
            if not self.visited or self.visited[-1] not in states:
                self._visit(states)
        return None

    def _went(self, number: int, now_s: float) -> Edge:
        """The machine has taken this outcome."""
        edge = self.machine.table[number]
        self.refused.pop(number, None)
        # A lost update leaves a gap: the edge itself says where the machine must have been.
        if walks(self.machine, edge.state, now_s - self._since_s):
            self.work.note_walk(len(self.visited))
        self._since_s = now_s
        self._visit((edge.state, *self._entered(edge)))
        self._count(edge, now_s)
        return edge

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
        if type(message) is Image:
            self._picture = message
        elif type(message) is Marks:
            self._claims.pop(message.edge, None)
            if self._picture is not None and zlib.crc32(self._picture.coded) == message.picture:
                self._claims[message.edge] = (self._picture, message)

    def question(self, request: Request) -> str:
        """What the console shows for a request, put together from the machine's table."""
        state = self._path(request).removeprefix("STATE_")
        if request.kind == "confirm":
            return f"{state} {self.machine.table[request.edge].event}"
        return f"{_VERBS[request.kind]} {state}"

    def spoken(self, request: Request) -> str:
        """The same as it is said: nobody names the containers around a state."""
        verb, _, path = self.question(request).rpartition(" ")
        return f"{verb} {path.rpartition('/')[2]}".strip() if request.kind != "confirm" else self.question(request)

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

    def note_sent(self, message: Message, request: int, now_s: float) -> None:
        """Remember what was sent: in answer to a request, or (0) because somebody wanted it."""
        if request and isinstance(message, ANSWERS):
            self._answered.setdefault(request, now_s)
            self._timed = None
        elif not request:
            self.sent[message.topic] = now_s, message

    def note_move(self, request: Request) -> None:
        """Remember a movement by hand."""
        self.moves[request.request] = self.moves.get(request.request, 0) + 1

    def note_in_lieu(self, state: str) -> None:
        """Remember that a state was done by hand."""
        self.in_lieu[state] = self.in_lieu.get(state, 0) + 1

    @property
    def seen_s(self) -> float:
        """When the newest view of the robot arrived; long ago if none did."""
        return max((t_s for t_s, _ in self.views.values()), default=-math.inf)

    def age_s(self, now_s: float) -> float:
        """How old the newest view is, since it arrived."""
        return now_s - self.seen_s

    def path_of(self, request: Request) -> str:
        """The state that asks."""
        return self._path(request)

    def _time_trips(self, now_s: float) -> None:
        """The effect of an answer is seen when its request is no longer open."""
        self._timed = self.mirror.snapshot
        still = [asked.request for asked in self.mirror.asked]
        for number in [n for n in self._answered if n not in still]:
            seen_s = now_s - self._answered.pop(number)
            self.trip_s = seen_s if self.trip_s is None else self.trip_s + _GAIN * (seen_s - self.trip_s)

    def _count(self, edge: Edge, now_s: float) -> None:
        if edge.kind in ("failed", "retry"):
            self.failed[edge.state] = self.failed.get(edge.state, 0) + 1
            self.failed_s = (*self.failed_s, now_s)
        elif edge.kind == "done":
            self.failed.pop(edge.state, None)

    def _path(self, request: Request) -> str:
        return self.machine.net.nodes[request.node].path

    def _entered(self, edge: Edge) -> tuple[str, ...]:
        inside = (s for s in self.mirror.states if s == edge.next_state or s.startswith(f"{edge.next_state}/"))
        return tuple(inside) or self.mirror.states

    def _visit(self, states: tuple[str, ...]) -> None:
        for state in states:
            if (state,) != self.visited[-1:]:
                self.visited = (*self.visited, state)
