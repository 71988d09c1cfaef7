"""A hypothesis strategy for machines: groups, concurrences, thresholds, counters, decisions, manual states, priority.

Every machine passes the checks by construction: the children of a group form a chain from its start to its way out, and
all other edges go wherever they like. A decision that passes by itself follows the chain, so that no machine goes round
for ever in no time. Tests get this module from the fixture ``random_machines``.
"""

from hypothesis import strategies as st

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import (
    INHERIT,
    PARKED,
    Concurrence,
    Counter,
    Edge,
    Element,
    Group,
    Row,
    Rule,
    State,
)

OUTCOMES = ("done", "failed")
"""Of every container; no state is called so."""

SLIP = "!slip"
"""Signal of a counted failure."""

SHAPES = ("work", "work", "counted", "decide", "manual", "group", "concurrence")

thresholds = st.integers(0, 3)
inherited = st.integers(INHERIT, 3)

Outcomes = tuple[tuple[str, str], ...]
"""As (event, kind)."""


@st.composite
def machines(draw, deepest: int = 2, widest: int = 4) -> Machine:
    """A machine with at most ``widest`` children a container, containers at most ``deepest`` deep."""
    with_end = draw(st.booleans())
    exits = ("End",) if with_end else OUTCOMES
    children, edges = _group(draw, deepest, widest, exits)
    if with_end:
        return Machine("random", "S0", (*children, State("End")), edges, ends=frozenset({"End"}))
    return Machine("random", "S0", children, edges, outcomes=OUTCOMES, goals=frozenset({"done"}))


@st.composite
def endless(draw, deepest: int = 2, widest: int = 4) -> Machine:
    """A machine that begins again and again until a person stops it while it rests."""
    states, edges = _group(draw, deepest, widest, OUTCOMES)
    round_ = Group("Round", "S0", states, edges, OUTCOMES)
    again = tuple(Edge("Round", outcome, "Rest", draw(inherited)) for outcome in OUTCOMES)
    rest = (
        Edge("Rest", "ok", "Round", draw(thresholds)),
        Edge("Rest", "stop", "done", 3, "command", "operator"),
    )
    return Machine("endless", "Round", (round_, State("Rest", "work")), (*again, *rest), outcomes=("done",))


def _group(draw, depth: int, widest: int, exits: tuple[str, ...]) -> tuple[tuple[Element, ...], tuple[Edge, ...]]:
    names = [f"S{k}" for k in range(draw(st.integers(1, widest)))]
    targets = st.sampled_from((*names, *exits))
    children, edges = [], []
    for name, onward in zip(names, (*names[1:], exits[0]), strict=True):
        child, outcomes = _child(draw, name, depth, widest)
        children.append(child)
        for k, (event, kind) in enumerate(outcomes):
            # The first outcome makes the chain; a retry stays.
            goal = onward if k == 0 else name if kind == "retry" else draw(targets)
            edges.append(_edge(draw, child, event, goal, kind))
    return tuple(children), tuple(edges)


def _edge(draw, child: Element, event: str, goal: str, kind: str) -> Edge:
    threshold = draw(thresholds if isinstance(child, State) else inherited)
    return Edge(child.name, event, goal, threshold, kind, "operator" if kind == "command" else "code")


def _child(draw, name: str, depth: int, widest: int) -> tuple[Element, Outcomes]:
    shape = draw(st.sampled_from(SHAPES))
    both = tuple((outcome, "done") for outcome in OUTCOMES)
    if depth > 0 and shape == "group":
        states, edges = _group(draw, depth - 1, widest, OUTCOMES)
        return Group(name, "S0", states, edges, OUTCOMES, priority=draw(st.booleans())), both
    if depth > 0 and shape == "concurrence":
        return _concurrence(draw, name, depth - 1, widest), both
    if shape == "decide":
        suggests = "ok" if name.startswith("S") and draw(st.booleans()) else ""
        return State(name, decides=True, suggests=suggests), (("ok", "done"), ("no", "done"))
    if shape == "manual":
        return State(name, manual=True), (("ok", "command"), ("no", "command"))
    if shape == "counted":
        return State(name, "work", (_row(draw),)), (("ok", "done"), ("retry", "retry"), ("fail", "failed"))
    return State(name, "work"), (("ok", "done"), ("fail", "failed"))


def _row(draw) -> Row:
    counter = Counter(draw(st.integers(0, 3)), "retry", draw(st.booleans()), draw(st.booleans()))
    return Row(SLIP, (counter,), "fail")


def _concurrence(draw, name: str, depth: int, widest: int) -> Concurrence:
    children, edges = [], []
    for k in range(draw(st.integers(2, 3))):
        child, outcomes = _child(draw, f"C{k}", depth, widest)
        children.append(child)
        edges += [_edge(draw, child, event, PARKED, kind) for event, kind in outcomes]
    pairs = [(edge.state, edge.event) for edge in edges]
    needs = draw(st.lists(st.sampled_from(pairs), min_size=1, max_size=2, unique_by=lambda pair: pair[0]))
    rules = (Rule(draw(st.sampled_from(OUTCOMES)), tuple(needs)),)
    finish, default = draw(st.sampled_from(("all", "any", "map"))), draw(st.sampled_from(OUTCOMES))
    return Concurrence(name, tuple(children), tuple(edges), OUTCOMES, finish, rules, default)
