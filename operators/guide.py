"""What a sensible person decides where ViGIR's behaviours ask: a table by state, and evidence of what has arrived.

The table is ``guide.toml``. A row holds if its evidence does (``EVIDENCE``) and it was not taken too often already; the
first that holds, and whose outcome the state has, is the choice.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any, Final, Literal

from teleop_sim.channel.messages import Confirm, Force, Message, Request, TakeOver
from teleop_sim.machines.declare import Edge, Machine
from teleop_sim.machines.sync import Asked
from teleop_sim.operators.at_work import LOST
from teleop_sim.operators.belief import Belief

Check = Literal["", "template", "hand", "world"]
"""What somebody sees to before an answer: the template's place, the hand's, or that the world model is forgotten."""

LEVER_RAD: Final = 0.75
"""A lever that went so far has let its bolt go (assumed: 43 degrees, more than the 40 at which ours does)."""
PUSHED_M: Final = 0.18
"""A lever that went so far with its door: 12 degrees about hinges 0.85 m away, as the task asks (assumed)."""
ROUND_RAD: Final = math.tau + 0.7
"""The task at the valve is 360 degrees (Romay et al., section 6.1.2); what a hand goes in its gaps until it touches a
spoke is felt as turning, too, and nobody minds more than enough (0.7 rad: assumed, two entries of 20 degrees)."""
STUCK_RAD: Final = 0.1
"""A turn by less brought nothing (assumed)."""


@dataclass(frozen=True)
class Row:
    """One choice. ``when``: evidence, empty: always. ``most``: times it is taken. ``by_hand``: goals in lieu."""

    when: str = ""
    most: int = 0
    take: str = ""
    by_hand: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rule:
    """All about the states of one name."""

    name: str
    check: Check = ""
    check_decision: Check = ""
    choices: tuple[Row, ...] = ()


@dataclass(frozen=True)
class InLieu:
    """What a person does in lieu of a state of this program whose name has this part."""

    program: str
    goals: tuple[str, ...]
    part: str = ""


def _off(*what: str) -> Callable[[Belief, Request], bool]:
    return lambda belief, request: belief.work.checked.get(request.request, "") in what


def _last(belief: Belief) -> str:
    return belief.work.last.done.outcome if belief.work.last is not None else ""


def pushed(belief: Belief) -> bool:
    """Did the last push swing the door far enough, as felt?"""
    last = belief.work.last
    return last is not None and last.is_push and abs(last.done.amount) >= PUSHED_M


def _ever_pushed(belief: Belief) -> bool:
    return any(f.is_push and abs(f.done.amount) >= PUSHED_M for f in belief.work.steps)


def round_once(belief: Belief) -> bool:
    """Has the wheel been turned as far as it should be, as felt? A thousandth is what an amount is told to."""
    return belief.work.turned() >= ROUND_RAD - 1e-3 * max(1, len(belief.work.steps))


def _stuck(belief: Belief) -> bool:
    last = belief.work.last
    return last is not None and last.is_turn and abs(last.done.amount) < STUCK_RAD


def _came_from(belief: Belief, what: str) -> bool:
    """Was the state before this one at work on that?"""
    return any(what in state for state in belief.visited[-2:-1])


EVIDENCE: Final[Mapping[str, Callable[[Belief, Request], bool]]] = MappingProxyType(
    {
        "": lambda _belief, _request: True,
        "template_off": _off("template"),
        "hand_off": _off("hand", "sensor"),
        "sensor_off": _off("sensor"),
        "lost": lambda belief, _request: _last(belief) in LOST,
        "pushed": lambda belief, _request: pushed(belief),
        "shut": lambda belief, _request: (
            not any(f.is_push and abs(f.done.amount) >= PUSHED_M for f in belief.work.steps)
        ),
        "turned": lambda belief, _request: belief.work.turned_now() >= LEVER_RAD and not _came_from(belief, "Push"),
        "turning": lambda belief, _request: not _came_from(belief, "Push"),
        "pushing": lambda belief, _request: _came_from(belief, "Push"),
        "round": lambda belief, _request: round_once(belief),
        "unfinished": lambda belief, _request: not round_once(belief),
        "stuck": lambda belief, _request: _stuck(belief),
        "there": lambda belief, _request: belief.work.stands_there,
    }
)
"""What a row can rest on, by name."""


def ends_all(machine: Machine, edge: Edge) -> bool:
    """Does the failure end the container that the state is in, with nobody asked what to do next?"""
    target = edge.next_state
    return target not in machine.state_names or edge.state.startswith(f"{target}/")


def world_first(belief: Belief, request: Request | Asked) -> bool:
    """Is a world model in doubt to be reset before this is answered: a failure that would end its container?

    Others can be let pass: people are asked what to do next, try again or take over, and who acts by hand resets it.
    """
    if request.kind != "confirm" or request.edge < 0 or not belief.work.doubts_world:
        return False
    edge = belief.machine.table[request.edge]
    return edge.kind == "failed" and ends_all(belief.machine, edge)


@dataclass(frozen=True)
class Guide:
    """The table."""

    rules: Mapping[str, Rule]
    in_lieu: tuple[InLieu, ...]

    def rule(self, machine: Machine, path: str) -> Rule:
        """Of a state; one that says nothing where there is none."""
        name = machine.leaf(path).name
        return self.rules.get(name, Rule(name))

    def check(self, belief: Belief, request: Request) -> Check:
        """What somebody is to look at before this is answered; empty: nothing."""
        if request.kind not in ("confirm", "decide") or self._fails(belief, request):
            return ""
        rule = self.rule(belief.machine, belief.path_of(request))
        return (request.kind == "decide" and rule.check_decision) or rule.check

    def choice(self, belief: Belief, request: Request) -> Row | None:
        """The row that holds; None: the table says nothing."""
        if request.kind not in ("confirm", "decide"):
            return None
        path, machine = belief.path_of(request), belief.machine
        for row in self.rule(machine, path).choices:
            known = machine.has_edge(path, row.take) if row.take else bool(row.by_hand)
            spent = row.most and belief.work.choices(path, _mark(row)) >= row.most
            if known and not spent and EVIDENCE[row.when](belief, request):
                return row
        return None

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """The choice as what is sent; nothing where the table is silent."""
        row, path = self.choice(belief, request), belief.path_of(request)
        if row is None:
            return ()
        belief.work.note_choice(path, _mark(row))
        if row.by_hand:
            return (TakeOver(request.node),)
        edge = belief.machine.edge_index(path, row.take)
        return (Confirm(request.request),) if edge == request.edge else (Force(edge, belief.mirror.seen),)

    def goals(self, machine: Machine, path: str) -> tuple[str, ...]:
        """What a person does in lieu of a state; nothing if nobody could."""
        by_hand = [row.by_hand for row in self.rule(machine, path).choices if row.by_hand]
        if by_hand:
            return by_hand[0]
        state = machine.leaf(path)
        fitting = (r.goals for r in self.in_lieu if r.program == state.program and r.part in state.name)
        return next(fitting, ())

    def done_event(self, machine: Machine, path: str) -> str:
        """The outcome that is forced when a state was done by hand; empty: it has none."""
        chosen = (row.take for row in self.rule(machine, path).choices if row.by_hand and row.take)
        done = (e.event for e in machine.outcomes_of(path) if e.kind == "done")
        return next(chosen, next(done, ""))

    def _fails(self, belief: Belief, request: Request) -> bool:
        return request.edge >= 0 and belief.machine.table[request.edge].kind in ("failed", "retry")


def _mark(row: Row) -> str:
    return row.take or "by hand"


@cache
def load_guide() -> Guide:
    """The table of ``guide.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("guide.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    rules = {entry["name"]: _rule(entry) for entry in tables["state"]}
    in_lieu = tuple(InLieu(e["program"], tuple(e["goals"]), e.get("part", "")) for e in tables["in_lieu"])
    return Guide(MappingProxyType(rules), in_lieu)


def _rule(entry: dict[str, Any]) -> Rule:
    rows = tuple(_row(row) for row in entry.get("choices", ()))
    return Rule(entry["name"], entry.get("check", ""), entry.get("check_decision", ""), rows)


def _row(entry: dict[str, Any]) -> Row:
    return Row(entry.get("when", ""), entry.get("most", 0), entry.get("take", ""), tuple(entry.get("by_hand", ())))
