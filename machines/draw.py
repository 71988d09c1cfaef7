"""A machine as a picture: DOT text, and SVG, PNG or PDF by Graphviz's program ``dot`` where it is installed.

Transitions have the colour of their threshold as in Fig. 5 of the ViGIR paper (off grey, low blue, high green, full
red); the shades are those of Okabe and Ito, "Color Universal Design" (2008), which the colour-blind can tell apart, and
the lines grow thicker with the threshold, so that a grey print tells as much.

Equal arguments give equal text. Not drawn: keys, parameters, failure counters, which
``teleop-sim machines show`` tells.
"""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.draw_text import COLOURS, attributes, legend, state_label
from teleop_sim.machines.elements import INHERIT, PARKED, Concurrence, Edge, Group, State
from teleop_sim.machines.net import TOP, Configuration, Node

HUB_FROM = 6
"""A state to which so many states lead is named beside each of them, without lines (chosen by look)."""

_ACTIVE, _AROUND, _MANUAL, _PLAIN = "#f0e442", "#fbf8d2", "#f4d3bd", "#ffffff"
_GRAPH = MappingProxyType(
    {"compound": "true", "fontname": "Helvetica", "nodesep": "0.25", "ranksep": "0.4", "labelloc": "b"}
)
_SHADES = ("#f4f6f8", "#e9edf1")
_ENDS_WHEN = MappingProxyType({"all": "when all have ended", "any": "when the first has ended", "map": "by its rules"})


@dataclass(frozen=True, slots=True)
class Look:
    """What is shown of a machine.

    Attributes:
        active: where it is now: highlighted.
        level: 0 to 3: what waits for a person at that level is dashed; None: all lines are whole.
        commands: also those outcomes of kind ``command`` that no decision asks for.
        stubs: lines to a state to which many lead end in a box with its name, and commands are written into
            their state; otherwise each is a line of its own.

    """

    active: Configuration | None = None
    level: int | None = None
    commands: bool = True
    stubs: bool = True


WHOLE = Look()
"""All of a machine, not running."""


def machine_dot(machine: Machine, look: Look = WHOLE) -> str:
    """DOT text: containers are frames (dashed if all inside is active at once), outcomes and ends are ovals."""
    drawing = _Drawing(machine, look)
    lines = ("  " * depth + text for depth, text in drawing.lines())
    return "\n".join(("digraph machine {", *lines, "}")) + "\n"


@dataclass(frozen=True)
class _Drawing:
    machine: Machine
    look: Look

    @cached_property
    def active(self) -> frozenset[int]:
        return frozenset(self.look.active.active if self.look.active else ())

    @cached_property
    def parked(self) -> frozenset[int]:
        return frozenset(self.look.active.parked if self.look.active else ())

    @cached_property
    def edges(self) -> tuple[tuple[int, Edge], ...]:
        """Those that are drawn, with their numbers."""
        table = enumerate(self.machine.net.edges)
        return tuple((i, e) for i, e in table if self.look.commands or not self._command(i, e))

    @cached_property
    def hubs(self) -> frozenset[int]:
        """Leaves to which so many states lead that their lines would hide the rest."""
        net = self.machine.net
        pairs = dict.fromkeys((net.source[i], net.target[i]) for i, e in self.edges if e.state != e.next_state)
        count = Tally(target for _, target in pairs if target >= 0 and isinstance(net.nodes[target].element, State))
        return frozenset(node for node, n in count.items() if n >= HUB_FROM)

    def lines(self) -> Iterator[tuple[int, str]]:
        yield 1, attributes("graph", label=legend(self.machine.name, self.look.level), **_GRAPH)
        yield 1, attributes("node", fontname="Helvetica", fontsize="11", shape="box", style="rounded,filled")
        yield 1, attributes("edge", fontname="Helvetica", fontsize="9", arrowsize="0.7")
        net = self.machine.net
        yield from self._inside(net.nodes[TOP], 1)
        yield from ((1, line) for i, edge in self.edges for line in self._edge(i, edge))

    def _inside(self, node: Node, depth: int) -> Iterator[tuple[int, str]]:
        element = node.element
        assert not isinstance(element, State)
        for child in (n for n in self.machine.net.nodes if n.parent == node.number):
            if isinstance(child.element, State):
                yield depth, self._leaf(child, node)
            else:
                yield from self._cluster(child, node, depth)
        for outcome in element.outcomes:
            ended = node.number == TOP and self.look.active is not None and self.look.active.outcome == outcome
            fill = _ACTIVE if ended else _PLAIN
            yield depth, attributes(_oval(node, outcome), label=outcome, shape="oval", fillcolor=fill)

    def _cluster(self, node: Node, parent: Node, depth: int) -> Iterator[tuple[int, str]]:
        element, around = node.element, any(self.machine.net.inside(n, node.number) for n in self.active)
        label, at_once = element.name, isinstance(element, Concurrence)
        if isinstance(element, Concurrence):
            label += f" (all at once; ends {_ENDS_WHEN[element.finish]})"
        if isinstance(element, Group) and element.priority:
            label += " (suspends all others)"
        fill = _ACTIVE if node.number in self.active else _AROUND if around else _SHADES[depth % 2]
        yield depth, f"subgraph cluster_{node.number} {{"
        looks = {"label": label, "style": "dashed,filled" if at_once else "rounded,filled", "fillcolor": fill}
        width = "3" if _begins(node, parent) else "1"
        yield depth + 1, attributes("graph", **looks, fontsize="12", penwidth=width, labelloc="t")
        yield from self._inside(node, depth + 1)
        yield depth, "}"

    def _leaf(self, node: Node, parent: Node) -> str:
        state, end = node.element, parent.number == TOP and node.path in self.machine.ends
        assert isinstance(state, State)
        person = "a person takes over" if state.manual else "a person decides" if state.decides else ""
        done = any(self.machine.net.source[i] == node.number for i in self.parked)
        notes = tuple(note for note in (person, "has ended" if done else "") if note)
        label = state_label(
            state.name,
            notes,
            tuple(e for i, e in self.edges if e.state == node.path and self._written(i, e)),
            self.look.level,
        )
        fill = _ACTIVE if node.number in self.active else _AROUND if done else _MANUAL if person else _PLAIN
        looks = {"shape": "oval" if end else "box", "penwidth": "3" if _begins(node, parent) else "1"}
        return attributes(f"n{node.number}", label=label, fillcolor=fill, **looks)

    def _command(self, number: int, edge: Edge) -> bool:
        """Is it a wish that a person may have? Where a person is asked to decide, it is what comes next."""
        state = self.machine.net.nodes[self.machine.net.source[number]].element
        return edge.kind == "command" and not (isinstance(state, State) and state.decides)

    def _written(self, number: int, edge: Edge) -> bool:
        """Loops of a state, and commands, are written into it: as lines they would hide the rest."""
        net = self.machine.net
        source, target = net.source[number], net.target[number]
        if target < 0 or not isinstance(net.nodes[source].element, State):
            return False
        return target == source or (self.look.stubs and self._command(number, edge))

    def _edge(self, number: int, edge: Edge) -> Iterator[str]:
        net = self.machine.net
        source, target = net.nodes[net.source[number]], net.target[number]
        tail, looks = self._tail(source, edge.event), self._line(edge)
        if target < 0:
            container = net.nodes[source.parent]
            for outcome, more in self._outcomes(container, source, edge, net.leads_to[number]):
                yield attributes(f"{tail} -> {_oval(container, outcome)}", **looks | more)
        elif self._written(number, edge):
            return
        elif self.look.stubs and target in self.hubs:
            stub, name = f"h{source.number}_{target}", net.nodes[target].element.name
            yield attributes(stub, label=name, shape="cds", fontsize="9", fillcolor="#eeeeee")
            yield attributes(f"{tail} -> {stub}", **looks)
        else:
            # Graphviz cuts a line at a frame only if it comes from outside.
            framed = not isinstance(net.nodes[target].element, State) and not net.inside(source.number, target)
            into = {"lhead": f"cluster_{target}"} if framed else {}
            yield attributes(f"{tail} -> n{net.nodes[target].entry[0]}", **looks, **into)

    def _outcomes(
        self, container: Node, source: Node, edge: Edge, leads_to: str
    ) -> Iterator[tuple[str, dict[str, str]]]:
        """Which outcomes of its container an outcome may help to: in a concurrence those of all rules that need it."""
        element = container.element
        if leads_to != PARKED or not isinstance(element, Concurrence):
            yield leads_to, {}
            return
        pair = (source.element.name, edge.event)
        ruled = tuple(dict.fromkeys(rule.outcome for rule in element.rules if pair in rule.needs))
        for outcome in ruled:
            yield outcome, {}
        if not ruled and element.default:
            yield element.default, {"label": f" {edge.event} (otherwise) "}

    def _line(self, edge: Edge) -> dict[str, str]:
        colour, operator = COLOURS[edge.threshold], edge.raised_by == "operator"
        waits = self.look.level is not None and not edge.passes(self.look.level)
        looks = {"label": f" {edge.event} ", "color": colour, "fontcolor": colour}
        looks["style"] = "dotted" if operator else "dashed" if waits else "solid"
        looks["penwidth"] = "0.8" if edge.threshold == INHERIT else f"{1 + 0.6 * edge.threshold:g}"
        return looks

    def _tail(self, node: Node, event: str) -> str:
        return f"n{node.number}" if isinstance(node.element, State) else _oval(node, event)


def _begins(node: Node, parent: Node) -> bool:
    around = parent.element
    return isinstance(around, Group) and node.element.name == around.start


def _oval(container: Node, outcome: str) -> str:
    assert not isinstance(container.element, State)
    return f"o{container.number}_{container.element.outcomes.index(outcome)}"
