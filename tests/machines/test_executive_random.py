"""What holds of every machine, whatever its programs do and whatever is commanded, and when.

``Site`` holds each run to: never two programs of one state; what is left is at rest before anything replaces it;
nothing starts or passes while paused; nothing outside a container of priority works when something in it starts; no
locked state is left; no outcome passes by itself unless its threshold is below the level; what the control station was
told adds up to what the executive is, whenever the clock moves on.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scripted_site import Asks, Site

from teleop_sim.core.records import Released, TransitionTaken
from teleop_sim.machines.declare import FELL
from teleop_sim.machines.elements import State
from teleop_sim.machines.modify import Patch, SetThreshold

COMMANDS = (
    "confirm", "confirm", "confirm", "reject", "answer", "answer", "force", "force", "force", "undeclared", "take over",
    "level", "lock", "unlock", "unlock", "pause", "resume", "resume", "attach", "modify",
)  # fmt: skip
"""More of those that let a machine go on."""


def script_of(machine, rng, falls):
    """Some attempts of every state, of times on a coarse grid so that instants coincide."""
    script = {}
    for node in machine.net.nodes[1:]:
        if isinstance(node.element, State) and node.element.program:
            signals = [e.event for e in machine.outcomes_of(node.path)] + [r.signal for r in node.element.rows]
            # The last one is repeated: it must take time, or a machine could go round for ever at one instant.
            script[node.path] = [*(step(rng, signals, falls) for _ in range(5)), (0.5, str(rng.choice(signals)))]
    return script


def step(rng, signals, falls):
    signal = FELL if falls and rng.random() < 0.03 else str(rng.choice(signals))
    seconds = float(rng.integers(0, 5)) * 0.5
    return Asks("where", seconds, signal) if rng.random() < 0.2 else (seconds, signal)


class Crowd:
    """Commands at random, most of them about something that is there."""

    def __init__(self, site, rng):
        self.site, self.rng, self.given = site, rng, 0

    def act(self):
        executive, rng = self.site.executive, self.rng
        command = str(rng.choice(COMMANDS))
        before, machine = len(self.site.of(Released)), executive.machine
        request = int(rng.choice([p.request for p in executive.pendings] or [0])) + int(rng.random() < 0.1)
        path = str(rng.choice(machine.state_names))
        if rng.random() < 0.7 and executive.running:
            path = str(rng.choice(list(executive._on_path()) or [path]))
        if command in ("confirm", "reject"):
            getattr(executive, command)(request)
        elif command == "answer":
            executive.answer(request, 7)
        elif command in ("force", "undeclared"):
            events = [e.event for e in machine.outcomes_of(path)]
            executive.force(str(rng.choice(events)) if events and command == "force" else "sing", path)
        elif command == "take over":
            executive.take_over(path)
        elif command == "level":
            executive.set_level(int(rng.integers(4)))
        elif command in ("lock", "unlock"):
            locked = [machine.state_names[n - 1] for n in executive.snapshot().locked]
            getattr(executive, command)(str(rng.choice(locked)) if locked and command == "unlock" else path)
        elif command in ("pause", "resume"):
            getattr(executive, command)()
        elif command == "attach":
            executive.attach(machine.checksum)
        else:
            self.modify(machine)
        self.given += 1
        assert len(self.site.of(Released)) == before + 1, command

    def end(self):
        self.given += 1
        self.site.executive.preempt()

    def modify(self, machine):
        edge = machine.table[int(self.rng.integers(len(machine.table)))]
        base = machine.checksum if self.rng.random() < 0.8 else 1
        threshold = int(self.rng.integers(4))
        self.site.executive.modify(Patch(base, (SetThreshold(edge.state, edge.event, threshold),)))


@settings(max_examples=80, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1), level=st.integers(0, 3), falls=st.booleans())
def test_whatever_is_commanded_every_run_keeps_the_rules(random_machines, data, seed, level, falls):
    machine = data.draw(random_machines.machines())
    rng = np.random.default_rng(seed)
    site = Site(machine, script_of(machine, rng, falls), level, rest_s=float(rng.choice([0.0, 0.25, 1.0])))
    crowd = Crowd(site, rng)
    for _ in range(40):
        site.at(float(rng.integers(0, 60)) * 0.5, *(crowd.act for _ in range(int(rng.integers(1, 4)))))
    site.at(31.0, crowd.end)
    result = site.run()
    assert result is not None, "the run ends after preempting"
    assert site.executive.pendings == ()
    assert len(site.of(Released)) == crowd.given
    if site.executive.mode == "not_recoverable":
        assert result.outcome == "failed"
    counts = [r for r in site.of(Released) if r.effect == "answered"]
    assert result.round_trips == len(counts)


@settings(max_examples=30, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_at_full_autonomy_a_machine_that_asks_nothing_runs_alone(random_machines, data, seed):
    machine = data.draw(random_machines.machines())
    rng = np.random.default_rng(seed)
    site = Site(machine, script_of(machine, rng, False), 3)
    site.at(40.0, site.executive.preempt)
    assert site.run() is not None
    assert {r.how for r in site.of(TransitionTaken)} <= {"autonomous"}
