"""What may be changed in a behaviour, one operation at a time. Each makes a new draft; only the last one is checked.

Not changed by any: rules of a concurrence, start states, keys that are read and written, failure counters. A state with
others of these is removed and added anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from teleop_sim.core.errors import UnknownName
from teleop_sim.machines.checks import closure
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Concurrence, Edge, Element, Given, Group, Parameter, State, Value
from teleop_sim.machines.net import join, walk

Container = Group | Concurrence


@dataclass(frozen=True, slots=True)
class Draft:
    """A machine that is being changed and not yet checked."""

    top: Group
    ends: frozenset[str]
    parameters: tuple[Parameter, ...]

    def finished(self, machine: Machine) -> Machine:
        """The machine, changed so. Raises ``BadInput`` if the checks refuse it."""
        top = self.top
        return replace(
            machine,
            states=top.states,
            edges=top.edges,
            data=top.data,
            spare=top.spare,
            ends=self.ends,
            parameters=self.parameters,
        )

    def element(self, path: str) -> Element:
        """What is at a path that is not empty; raises ``UnknownName``."""
        known = {p: element for p, _, element in walk(self.top) if p}
        if path not in known:
            raise UnknownName("state", path, tuple(known))
        return known[path]

    def container(self, path: str) -> Container:
        """The container at a path; empty: the top. Raises ``UnknownName``."""
        known = {p: element for p, _, element in walk(self.top) if not isinstance(element, State)}
        if path not in known:
            raise UnknownName("container", path, tuple(p or '""' for p in known))
        return known[path]

    def with_element(self, path: str, new: Element) -> Draft:
        """With another element at a path."""
        top = _with(self.top, tuple(path.split("/")) if path else (), new)
        assert isinstance(top, Group)
        return replace(self, top=top)

    def with_edge(self, path: str, event: str, change: Callable[[Edge], Edge | None]) -> Draft:
        """With another edge instead of one, or with none; raises ``UnknownName``."""
        self.element(path)
        around, _, name = path.rpartition("/")
        container = self.container(around)
        events = tuple(e.event for e in container.edges if e.state == name)
        if event not in events:
            raise UnknownName(f"{path}: event", event, events)
        edges = (change(e) if (e.state, e.event) == (name, event) else e for e in container.edges)
        return self.with_element(around, _with_edges(container, tuple(e for e in edges if e is not None)))


def _with_edges(container: Container, edges: tuple[Edge, ...]) -> Container:
    """A spare state that is reached now is not spare any more."""
    if isinstance(container, Concurrence):
        return replace(container, edges=edges)
    reached = closure([container.start], ((edge.state, edge.next_state) for edge in edges))
    return replace(container, edges=edges, spare=tuple(name for name in container.spare if name not in reached))


def draft_of(machine: Machine) -> Draft:
    """The machine before anything is changed."""
    return Draft(machine.top, machine.ends, machine.parameters)


def _with(element: Element, names: tuple[str, ...], new: Element) -> Element:
    if not names:
        return new
    assert not isinstance(element, State)
    states = (_with(child, names[1:], new) if child.name == names[0] else child for child in element.states)
    return replace(element, states=tuple(states))


@dataclass(frozen=True, slots=True)
class AddState:
    """A state or container, last in its container, with edges of that container: to it and from it.

    Attributes:
        container: path; empty for the top.
        state: with all that is in it.
        edges: put last.
        end: of the top alone: the machine stops in it.

    """

    container: str
    state: Element
    edges: tuple[Edge, ...] = ()
    end: bool = False

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        around = draft.container(self.container)
        new = replace(_with_edges(around, (*around.edges, *self.edges)), states=(*around.states, self.state))
        ends = draft.ends | {join(self.container, self.state.name)} if self.end else draft.ends
        return replace(draft.with_element(self.container, new), ends=ends)


@dataclass(frozen=True, slots=True)
class RemoveState:
    """A state or container goes, with its own edges; edges that lead to it must be led elsewhere."""

    path: str

    def on(self, draft: Draft) -> Draft:
        """The draft without it; raises ``UnknownName``."""
        draft.element(self.path)
        around, _, name = self.path.rpartition("/")
        container = draft.container(around)
        states = tuple(child for child in container.states if child.name != name)
        edges = tuple(edge for edge in container.edges if edge.state != name)
        new = replace(container, states=states, edges=edges)
        if isinstance(new, Group):
            new = replace(new, spare=tuple(spare for spare in new.spare if spare != name))
        return replace(draft.with_element(around, new), ends=draft.ends - {self.path})


@dataclass(frozen=True, slots=True)
class AddOutcome:
    """An edge, last in its container."""

    container: str
    edge: Edge

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        around = draft.container(self.container)
        draft = draft.with_element(self.container, _with_edges(around, (*around.edges, self.edge)))
        path = join(self.container, self.edge.state)
        element = draft.element(path)
        # What lists its outcomes lists them all; a state that lists none has those of its edges.
        if (isinstance(element, State) and not element.outcomes) or self.edge.event in element.outcomes:
            return draft
        return draft.with_element(path, replace(element, outcomes=(*element.outcomes, self.edge.event)))


@dataclass(frozen=True, slots=True)
class RemoveOutcome:
    """An edge goes."""

    path: str
    event: str

    def on(self, draft: Draft) -> Draft:
        """The draft without it; raises ``UnknownName``."""
        draft = draft.with_edge(self.path, self.event, lambda _: None)
        element = draft.element(self.path)
        outcomes = tuple(outcome for outcome in element.outcomes if outcome != self.event)
        return draft.with_element(self.path, replace(element, outcomes=outcomes))


@dataclass(frozen=True, slots=True)
class SetTarget:
    """An edge leads elsewhere: to a sibling by name or to an outcome of the container."""

    path: str
    event: str
    next_state: str

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        return draft.with_edge(self.path, self.event, lambda edge: replace(edge, next_state=self.next_state))


@dataclass(frozen=True, slots=True)
class SetThreshold:
    """An edge gets another threshold, -1 to 3."""

    path: str
    event: str
    threshold: int

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        return draft.with_edge(self.path, self.event, lambda edge: replace(edge, threshold=self.threshold))


@dataclass(frozen=True, slots=True)
class SetParameter:
    """A parameter of a state gets another value."""

    path: str
    name: str
    value: Value | Given

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        element = draft.element(self.path)
        if not isinstance(element, State):
            raise UnknownName("state without states inside", self.path, ())
        held = _held(f"{self.path}: parameter", element.parameters, self.name, self.value)
        return draft.with_element(self.path, replace(element, parameters=held))


@dataclass(frozen=True, slots=True)
class SetData:
    """A key with which a container starts (path; empty: the top) holds something else at its start."""

    path: str
    key: str
    value: Value | Given

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        container = draft.container(self.path)
        held = _held(f"{self.path}: start data", container.data, self.key, self.value)
        return draft.with_element(self.path, replace(container, data=held))


@dataclass(frozen=True, slots=True)
class SetDefault:
    """A parameter of the behaviour gets another value."""

    parameter: str
    value: Value

    def on(self, draft: Draft) -> Draft:
        """The draft with it; raises ``UnknownName``."""
        names = tuple(p.name for p in draft.parameters)
        if self.parameter not in names:
            raise UnknownName("parameter", self.parameter, names)
        new = (replace(p, default=self.value) if p.name == self.parameter else p for p in draft.parameters)
        return replace(draft, parameters=tuple(new))


Operation = (
    AddState | RemoveState | AddOutcome | RemoveOutcome | SetTarget | SetThreshold | SetParameter | SetData | SetDefault
)


@dataclass(frozen=True, slots=True)
class Patch:
    """Operations, and the checksum of the machine that they were made for."""

    base_checksum: int
    operations: tuple[Operation, ...]


Held = tuple[tuple[str, Value | Given], ...]


def _held(where: str, held: Held, name: str, value: Value | Given) -> Held:
    """With another value of one name, which must be there."""
    names = tuple(key for key, _ in held)
    if name not in names:
        raise UnknownName(where, name, names)
    return tuple((key, value if key == name else old) for key, old in held)
