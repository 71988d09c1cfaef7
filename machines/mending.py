"""What a published machine lacks, and the least that is changed so that it can be declared."""

from __future__ import annotations

from dataclasses import dataclass, replace

from teleop_sim.machines.elements import Edge, Group, State


@dataclass(frozen=True, slots=True)
class Mending:
    """One lack of an original and what is changed: exactly one of the last three.

    Attributes:
        path: of the state or container.
        lacks: what the original lacks, in words.
        refused: what the checks say of the original for it, each as "place: what is wrong" without the machine's name.
        leave_out: it goes, with everything in it and its edges. Nothing else can lead to it, so nothing else changes.
        manual: nothing runs in it: it waits for a person.
        add: an outcome that it gets; named by its state's own name.

    """

    path: str
    lacks: str
    refused: tuple[str, ...]
    leave_out: bool = False
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
    if mending.leave_out:
        states = tuple(s for s in group.states if s is not child)
        return replace(group, states=states, edges=tuple(e for e in group.edges if e.state != child.name))
    if mending.add is not None:
        return replace(group, edges=(*group.edges, mending.add))
    assert isinstance(child, State)
    states = tuple(replace(child, manual=True) if s is child else s for s in group.states)
    return replace(group, states=states)
