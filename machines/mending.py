"""What a published machine lacks, and the least that is changed so that it can be declared."""

from __future__ import annotations

from dataclasses import dataclass, replace

from teleop_sim.machines.elements import Edge, Element, Group, State


@dataclass(frozen=True, slots=True)
class Mending:
    """One lack of an original and what is changed: one of the last four, or the first with the second.

    Attributes:
        path: of the state or container.
        lacks: what the original lacks, in words.
        refused: what the checks say of the original for it, each as "place: what is wrong" without the machine's name.
        spare: nothing leads there: it is kept as declared, as one that is spare.
        unsuggest: path, from there, of a decision whose suggestion it does not know: it suggests nothing.
        manual: nothing runs in it: it waits for a person.
        add: an outcome that it gets; named by its state's own name.

    """

    path: str
    lacks: str
    refused: tuple[str, ...]
    spare: bool = False
    unsuggest: str = ""
    manual: bool = False
    add: Edge | None = None


def mended(top: Group, mendings: tuple[Mending, ...]) -> Group:
    """The machine's top with all mendings made, in order.

    Raises:
        KeyError: a path that does not lead to a state.

    """
    for mending in mendings:
        top = _within(top, mending.path.split("/"), mending)
    return top


def _within(group: Group, names: list[str], mending: Mending) -> Group:
    child = {s.name: s for s in group.states}[names[0]]
    if len(names) > 1:
        assert isinstance(child, Group)
        states = tuple(_within(child, names[1:], mending) if s is child else s for s in group.states)
        return replace(group, states=states)
    if mending.spare:
        kept = _unsuggested(child, mending.unsuggest)
        states = tuple(kept if s is child else s for s in group.states)
        return replace(group, states=states, spare=(*group.spare, child.name))
    if mending.add is not None:
        return replace(group, edges=(*group.edges, mending.add))
    assert isinstance(child, State)
    states = tuple(replace(child, manual=True) if s is child else s for s in group.states)
    return replace(group, states=states)


def _unsuggested(element: Element, path: str) -> Element:
    """Without the suggestion of the decision at the path within; as it is where there is no path."""
    if not path:
        return element
    assert not isinstance(element, State)
    name, _, rest = path.partition("/")
    states = tuple(_silent(s, rest) if s.name == name else s for s in element.states)
    return replace(element, states=states)


def _silent(element: Element, rest: str) -> Element:
    if isinstance(element, State):
        return replace(element, suggests="")
    return _unsuggested(element, rest)
