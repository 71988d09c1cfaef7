"""What a run did with its machine as a picture: DOT text, laid out by Graphviz as ``draw.py``'s is.

States that were visited carry their time and the colour of the worst mode that they needed; outcomes that were taken
are thick lines with their counts, coloured by who let them pass. What was not visited is named in grey, and of a
container of which nothing was visited only its name; outcomes that were not taken are thin lines, drawn only between
visited states.
Colours are tints of Okabe and Ito's. Equal arguments give equal text.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from textwrap import wrap
from types import MappingProxyType

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.draw_text import Html, attributes, html
from teleop_sim.machines.elements import Concurrence, State
from teleop_sim.machines.net import TOP, Node

MODE_FILLS = MappingProxyType(
    {"normal": "#cfe4f3", "auto": "#fbe2b0", "manual": "#f6c9ab", "not_recoverable": "#b9b9b9"}
)
"""Mode to the fill of its states."""
MODE_WORDS = MappingProxyType(
    {"auto": "autonomous recovery", "manual": "manual recovery", "not_recoverable": "not recoverable"}
)
HOW_COLOURS = MappingProxyType({"autonomous": "#0072b2", "confirmed": "#009e73", "forced": "#d55e00"})
"""How an outcome passed, from the least to the most of a person's doing, to the colour of its line."""
GREY, FAINT = "#9a9a9a", "#cfcfcf"
WRAP = 34
"""Letters in a line of the names of what was not visited (a choice of layout)."""
WIDEST = 6.0
"""Of a line [points], however often it was taken (a choice of layout)."""
_GRAPH = MappingProxyType(
    {
        "compound": "true",
        "fontname": "Helvetica",
        "nodesep": "0.2",
        "ranksep": "0.35",
        "labelloc": "b",
        "bgcolor": "white",
    }
)


@dataclass(frozen=True)
class Stay:
    """A state in a run: time in all its visits [s], their number, and the worst mode that one needed."""

    time_s: float
    visits: int
    mode: str


@dataclass(frozen=True)
class Seen:
    """What a run did.

    Attributes:
        stays: by the path of the state.
        taken: how often an outcome was taken in which way, by (path, event) and then by ``HOW_COLOURS``' names;
            in the order in which they were first taken.
        last: path of the state in which it ended.

    """

    stays: Mapping[str, Stay]
    taken: Mapping[tuple[str, str], Mapping[str, int]] = field(default_factory=dict)
    last: str = ""


def visits_dot(machine: Machine, seen: Seen) -> str:
    """DOT text of a machine and what a run did with it."""
    lines = ("  " * depth + text for depth, text in _Visits(machine, seen).lines())
    return "\n".join(("digraph visits {", *lines, "}")) + "\n"


@dataclass(frozen=True)
class _Visits:
    machine: Machine
    seen: Seen

    @cached_property
    def visited(self) -> frozenset[int]:
        """Numbers of the states that are drawn: visited ones, what lines lead to, and all containers round them."""
        net = self.machine.net
        paths = (*self.seen.stays, *(path for path, _ in self.seen.taken))
        numbers = [number for path in paths if (number := net.by_path.get(path)) is not None]
        numbers += [net.target[n] for n, edge in enumerate(net.edges) if (edge.state, edge.event) in self.seen.taken]
        found: set[int] = set()
        while numbers:
            number = numbers.pop()
            if number > TOP and number not in found:
                found.add(number)
                # A container that is drawn open is entered at its first states.
                numbers += [net.nodes[number].parent, *net.nodes[number].entry]
        return frozenset(found)

    @cached_property
    def first(self) -> frozenset[tuple[str, str]]:
        """Outcomes that led to a state for the first time: of each state the one that was taken first."""
        net = self.machine.net
        found: dict[int, tuple[str, str]] = {}
        for path, event in self.seen.taken:
            number = net.number(path, event)
            if number is not None and net.target[number] != net.source[number]:
                found.setdefault(net.target[number], (path, event))
        return frozenset(found.values())

    def lines(self) -> Iterator[tuple[int, str]]:
        yield 1, attributes("graph", label=self._legend(), **_GRAPH)
        yield 1, attributes("node", fontname="Helvetica", fontsize="11", shape="box", style="rounded,filled")
        yield 1, attributes("edge", fontname="Helvetica", fontsize="10", arrowsize="0.7")
        yield from self._inside(self.machine.net.nodes[TOP], 1)
        for number in range(len(self.machine.net.edges)):
            yield from ((1, line) for line in self._edge(number))

    def _inside(self, around: Node, depth: int) -> Iterator[tuple[int, str]]:
        net, element = self.machine.net, around.element
        children = [n for n in net.nodes if n.parent == around.number]
        for node in (n for n in children if n.number in self.visited):
            if isinstance(node.element, State):
                yield depth, self._box(node)
            else:
                yield from self._frame(node, depth)
        if others := [_name(n) for n in children if n.number not in self.visited]:
            text = "<br/>".join(html(line) for line in wrap(f"not visited: {', '.join(others)}", WRAP))
            looks = {"shape": "plain", "style": "solid", "fontcolor": GREY, "fontsize": "9"}
            yield depth, attributes(f"u{around.number}", label=Html(f"<{text}>"), **looks)
        assert not isinstance(element, State)
        for outcome in element.outcomes:
            if outcome in self._ended_with(around):
                yield depth, attributes(_oval(around, outcome), label=outcome, shape="oval", fillcolor="#ffffff")

    def _frame(self, node: Node, depth: int) -> Iterator[tuple[int, str]]:
        looks = {"label": node.element.name, "style": "rounded,filled", "fillcolor": "#f4f4f4", "color": GREY}
        if isinstance(node.element, Concurrence):
            looks |= {"label": f"{node.element.name} (all at once)", "style": "dashed,filled"}
        yield depth, f"subgraph cluster_{node.number} {{"
        yield depth + 1, attributes("graph", **looks, fontsize="12", labelloc="t")
        yield from self._inside(node, depth + 1)
        yield depth, "}"

    def _box(self, node: Node) -> str:
        stay = self.seen.stays.get(node.path)
        if stay is None:
            return attributes(f"n{node.number}", label=_name(node), fillcolor="#ffffff", color=GREY, fontcolor=GREY)
        times = f"{stay.visits} \u00d7, " if stay.visits > 1 else ""
        text = f'<b>{html(_name(node))}</b><br/><font point-size="10">{times}{stay.time_s:.1f} s</font>'
        looks = {"fillcolor": MODE_FILLS.get(stay.mode, MODE_FILLS["normal"]), "color": "#000000"}
        width = "3" if node.path == self.seen.last else "1"
        return attributes(f"n{node.number}", label=Html(f"<{text}>"), penwidth=width, **looks)

    def _edge(self, number: int) -> Iterator[str]:
        net = self.machine.net
        edge, target, source = net.edges[number], net.target[number], net.nodes[net.source[number]]
        taken = self.seen.taken.get((edge.state, edge.event), {})
        count = sum(taken.values())
        tail = f"n{source.number}" if isinstance(source.element, State) else _oval(source, edge.event)
        if not count:
            # Commands are wishes that a person may always have: they would hide the rest.
            plain = edge.kind != "command" and isinstance(source.element, State) and target != source.number
            if plain and target in self.visited and source.number in self.visited:
                yield attributes(
                    f"{tail} -> {self._head(target)}", color=FAINT, penwidth="0.8", **self._into(source, target)
                )
            return
        how = max(taken, key=lambda name: list(HOW_COLOURS).index(name) if name in HOW_COLOURS else 0)
        looks = {"color": HOW_COLOURS.get(how, GREY), "fontcolor": HOW_COLOURS.get(how, GREY)}
        looks |= {"penwidth": f"{min(1.4 + 0.8 * count, WIDEST):g}", "label": f" {edge.event}{_times(count)} "}
        if (edge.state, edge.event) in self.first:
            # Straight down: so the drawing stays narrow.
            looks["weight"] = "20"
        if target < 0:
            container = net.nodes[source.parent]
            if outcome := self._outcome(number, container):
                yield attributes(f"{tail} -> {_oval(container, outcome)}", **looks)
        else:
            yield attributes(f"{tail} -> {self._head(target)}", **looks, **self._into(source, target))

    def _head(self, target: int) -> str:
        """Where a line to a node ends: a container that is drawn open is entered at its first state."""
        node = self.machine.net.nodes[target]
        opened = target in self.visited and not isinstance(node.element, State)
        return f"n{node.entry[0]}" if opened else f"n{target}"

    def _into(self, source: Node, target: int) -> dict[str, str]:
        """Graphviz cuts a line at a frame only if it comes from outside."""
        net = self.machine.net
        opened = target in self.visited and not isinstance(net.nodes[target].element, State)
        return {"lhead": f"cluster_{target}"} if opened and not net.inside(source.number, target) else {}

    def _outcome(self, number: int, container: Node) -> str:
        leads_to = self.machine.net.leads_to[number]
        assert not isinstance(container.element, State)
        # In a concurrence an outcome may only help to the container's.
        return leads_to if leads_to in container.element.outcomes else ""

    def _ended_with(self, container: Node) -> frozenset[str]:
        """Outcomes with which a container was left, or which lines lead to."""
        net = self.machine.net
        ended = {event for path, event in self.seen.taken if path == container.path}
        led = {
            self._outcome(n, container)
            for n, edge in enumerate(net.edges)
            if net.target[n] < 0
            and net.nodes[net.source[n]].parent == container.number
            and self.seen.taken.get((edge.state, edge.event))
        }
        return frozenset(ended | led)

    def _legend(self) -> Html:
        used = {stay.mode for stay in self.seen.stays.values()}
        ways = {how for taken in self.seen.taken.values() for how in taken}
        rows = [
            *(
                f'<tr><td width="24" bgcolor="{fill}"></td><td align="left">{MODE_WORDS.get(mode, mode)}</td></tr>'
                for mode, fill in MODE_FILLS.items()
                if mode in used
            ),
            *(
                f'<tr><td width="24" height="3" bgcolor="{colour}"></td><td align="left">{how}</td></tr>'
                for how, colour in HOW_COLOURS.items()
                if how in ways
            ),
            '<tr><td></td><td align="left">thin grey line: not taken</td></tr>',
        ]
        return Html(f'<<table border="0" cellspacing="2" cellpadding="1">{"".join(rows)}</table>>')


def _name(node: Node) -> str:
    """A state's name without what all of a published machine's begin with."""
    return node.element.name.removeprefix("STATE_")


def _times(count: int) -> str:
    return f" \u00d7{count}" if count > 1 else ""


def _oval(container: Node, outcome: str) -> str:
    assert not isinstance(container.element, State)
    return f"o{container.number}_{container.element.outcomes.index(outcome)}"
