"""A field site whose programs follow a script, and a control station that hears every word at once.

Whenever the clock is about to move on, what the executive has told must add up to what it is (``Follower``); and its
programs must keep the rules that every run keeps (``Site``).
"""

from __future__ import annotations

from collections import Counter as Tally
from dataclasses import dataclass, field, replace

import simpy

from teleop_sim.core.records import Released, TransitionTaken
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.executive import Executive, Signal
from teleop_sim.machines.sync import Asked, Snapshot

REST_S = 0.25
"""Time that a scripted robot needs to come to rest."""


@dataclass(frozen=True)
class Asks:
    """A program that asks for data at once, and ends ``seconds`` after they have come; it writes them as ``data``.

    It waits no longer than ``patience_s``.
    """

    what: str
    seconds: float
    signal: str
    patience_s: float = 1e9


@dataclass
class Follower:
    """What somebody knows who is told everything: a copy that does not know the executive."""

    machine: Machine
    now: Snapshot
    executive: Executive | None = field(default=None, repr=False)

    def transition(self, edge: int) -> None:
        move = self.machine.net.move(self.now.configuration, edge)
        asked = tuple(a for a in self.now.asked if a.node not in move.left)
        self.now = replace(self.now, configuration=move.configuration, asked=asked)

    def mode(self, mode: str) -> None:
        self.now = replace(self.now, mode=mode)

    def level(self, level: int) -> None:
        self.now = replace(self.now, level=level)

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        self.now = replace(self.now, asked=tuple(sorted((*self.now.asked, Asked(request, kind, node, edge)))))

    def withdrawn(self, request: int) -> None:
        assert any(a.request == request for a in self.now.asked), f"request {request} is not open"
        self.now = replace(self.now, asked=tuple(a for a in self.now.asked if a.request != request))

    def paused(self, paused: bool) -> None:
        assert paused != self.now.paused
        self.now = replace(self.now, paused=paused)

    def locked(self, node: int, locked: bool) -> None:
        rest = {n for n in self.now.locked if n != node}
        self.now = replace(self.now, locked=tuple(sorted(rest | {node} if locked else rest)))

    def snapshot(self) -> None:
        assert self.executive is not None
        self.machine, self.now = self.executive.machine, self.executive.snapshot()

    def line(self, text: str) -> None:
        """Says nothing of the machine's state."""


class Site:
    """A field site without a robot.

    ``script``: state, or its program's name, to a list of what its program does, one entry an attempt, the last one
    again and again: (seconds, signal), (seconds, signal, writes) or ``Asks``. ``answer_s``: confirm every suggestion
    after so long. ``rest_s``: how long programs need to come to rest.
    """

    def __init__(self, machine, script, level=3, answer_s=None, rest_s=REST_S):
        self.env = simpy.Environment()
        self.script = {state: list(steps) for state, steps in script.items()}
        self.records, self.heard, self.started, self.starts = [], [], [], []
        self.interrupted, self.stopped = [], []
        self.answer_s, self.rest_s = answer_s, rest_s
        self.alive = Tally()
        self.follower = Follower(machine, Snapshot(machine.checksum, machine.net.begin(), level))
        self.executive = Executive(self.env, machine, level, self.start, self, self.record)
        self.follower.executive = self.executive

    # The robot

    def start(self, start):
        assert not self.follower.now.paused, "nothing starts while paused"
        assert not self.alive[start.path], f"{start.path} works twice"
        self._alone(start.path)
        self.alive[start.path] += 1
        self.started.append((self.env.now, start.path))
        self.starts.append(start)
        return self.env.process(self._program(start))

    def _alone(self, path):
        """Nothing outside a container of priority works when something in it starts."""
        net = self.follower.machine.net
        for around in net.containers(net.by_path[path]):
            if getattr(net.nodes[around].element, "priority", False):
                outside = [p for p in +self.alive if not net.inside(net.by_path[p], around)]
                assert not outside, f"{outside} at work beside {net.nodes[around].path}"

    def _program(self, start):
        steps = self.script[start.path if start.path in self.script else start.program]
        step = steps.pop(0) if len(steps) > 1 else steps[0]
        try:
            if isinstance(step, Asks):
                given = start.ask(step.what)
                yield given | self.env.timeout(step.patience_s)
                step = (step.seconds, step.signal, {"data": given.value if given.triggered else None})
            yield self.env.timeout(step[0])
        except simpy.Interrupt as why:
            self.interrupted.append((self.env.now, str(why.cause)))
            self.stopped.append((self.env.now, start.path))
            yield self.env.timeout(self.rest_s)
            return Signal("stopped")
        finally:
            self.alive[start.path] -= 1
        return Signal(step[1], f"after {step[0]} s", *step[2:])

    # The voice

    def transition(self, edge):
        self.heard.append((self.env.now, "transition", edge))
        self._leave(edge)
        self.follower.transition(edge)

    def _leave(self, edge):
        """The rules of every transition: see what the control station knew just before it."""
        net, now = self.follower.machine.net, self.follower.now
        move = net.move(now.configuration, edge)
        assert not now.paused, "nothing passes while paused"
        at_work = [net.nodes[n].path for n in move.left if self.alive[net.nodes[n].path]]
        assert not at_work, f"left while at work: {at_work}"
        for node in now.locked:
            gone = net.on_path(now.configuration, node) and not net.on_path(move.configuration, node)
            touched = gone or net.source[edge] == node
            assert not touched, f"{net.nodes[node].path} is locked"

    def mode(self, mode):
        self.heard.append((self.env.now, "mode", mode))
        self.follower.mode(mode)

    def level(self, level):
        self.heard.append((self.env.now, "level", level))
        self.follower.level(level)

    def request(self, request, kind, node, edge):
        self.heard.append((self.env.now, "request", request, kind, node, edge))
        self.follower.request(request, kind, node, edge)
        if self.answer_s is not None and kind == "confirm":
            self.at(self.env.now + self.answer_s, lambda: self.executive.confirm(request))

    def withdrawn(self, request):
        self.heard.append((self.env.now, "withdrawn", request))
        self.follower.withdrawn(request)

    def paused(self, paused):
        self.heard.append((self.env.now, "paused", paused))
        self.follower.paused(paused)

    def locked(self, node, locked):
        self.heard.append((self.env.now, "locked", node, locked))
        self.follower.locked(node, locked)

    def snapshot(self):
        self.heard.append((self.env.now, "snapshot", self.executive.snapshot()))
        self.follower.snapshot()

    def line(self, text):
        self.heard.append((self.env.now, text))

    # The log

    def record(self, record):
        if isinstance(record, TransitionTaken) and record.how == "autonomous":
            assert record.threshold < max(record.level, 0) or record.threshold == -1
        self.records.append(record)

    # The test

    def told(self, what):
        """The last word of a kind."""
        return next(h for h in reversed(self.heard) if h[1] == what)

    def at(self, when_s, *acts):
        """Do something then; several in this order, at one instant."""

        def later():
            yield self.env.timeout(when_s - self.env.now)
            for act in acts:
                before = len(self.of(Released))
                act()
                self.commanded = self.of(Released)[before:]

        self.env.process(later())

    def run(self, until_s=10_000.0):
        """The machine's result; None if it goes on then."""
        self.process = self.env.process(self.executive.run())
        self.go_on(until_s)
        return self.process.value if self.process.triggered else None

    def go_on(self, until_s):
        """Let the clock run, until the machine has ended; look whenever it is about to move on."""
        while self.env.peek() <= until_s and not self.process.processed:
            if self.env.peek() > self.env.now:
                self.look()
            self.env.step()
        if self.process.processed:
            assert not +self.alive, "at work after the end"
            self.look()

    def look(self):
        told, true = self.follower.now, self.executive.snapshot()
        assert told == true, f"at {self.env.now} s told {told}, is {true}"

    def of(self, kind):
        return [r for r in self.records if isinstance(r, kind)]

    def events(self):
        return [r.event for r in self.of(TransitionTaken)]

    def taken(self):
        """Transitions as (time, path, event, how)."""
        return [(r.t_s, r.state, r.event, r.how) for r in self.of(TransitionTaken)]

    def effects(self):
        return [r.effect for r in self.of(Released)]
