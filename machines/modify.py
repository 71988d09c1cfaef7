"""A behaviour changed while it runs: what is to be changed is data, named by the checksum of what it changes.

Operations are done in their order; the checks see only the result, so what one operation leaves open a later one may
close. ``pack_patch`` makes bytes of a patch for the link.

As in FlexBE (Schillinger, Kohlbrecher and von Stryk, "Human-robot collaborative high-level control with application to
rescue robotics", ICRA 2016): both sites change their own copy and go on only if the checksums agree.
"""

from __future__ import annotations

from collections.abc import Iterable

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Concurrence, Group, State
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.operations import (
    AddOutcome,
    AddState,
    Operation,
    Patch,
    RemoveOutcome,
    RemoveState,
    SetData,
    SetDefault,
    SetParameter,
    SetTarget,
    SetThreshold,
    draft_of,
)
from teleop_sim.machines.patch_bytes import BadPatch, pack_patch, unpack_patch

__all__ = [
    "AddOutcome",
    "AddState",
    "BadPatch",
    "Operation",
    "Patch",
    "RemoveOutcome",
    "RemoveState",
    "SetData",
    "SetDefault",
    "SetParameter",
    "SetTarget",
    "SetThreshold",
    "apply",
    "pack_patch",
    "unpack_patch",
    "vanishing",
]


def apply(machine: Machine, patch: Patch) -> Machine:
    """The changed machine.

    Raises:
        BadInput: the checksum is another machine's, an operation names what is not there, or the checks refuse the
            result: with all reasons.

    """
    found: list[Problem] = []
    if patch.base_checksum != machine.checksum:
        what = f"it changes a machine of checksum {patch.base_checksum:08x}, this one has {machine.checksum:08x}"
        found.append(Problem(f"patch of {machine.name}", what, "Bring both sites to the same machine first."))
    draft = draft_of(machine)
    for number, operation in enumerate(patch.operations, 1):
        at = f"patch of {machine.name}: {number}. {type(operation).__name__}"
        try:
            draft = operation.on(draft)
        except BadInput as error:
            found += (Problem(f"{at}: {p.where}", p.what, p.hint) for p in error.problems)
    try:
        changed = draft.finished(machine)
    except BadInput as error:
        # After operations that could not be done, the checks would complain of what these left undone.
        raise BadInput(tuple(found or error.problems)) from None
    if found:
        raise BadInput(tuple(found))
    return changed


def vanishing(
    machine: Machine, changed: Machine, configuration: Configuration, needed: Iterable[tuple[str, str]] = ()
) -> tuple[str, ...]:
    """What a running machine would miss in a changed one; it can go on with it only if this is empty.

    Active states, edges of parked children and those needed, (path, event), must still be there and run the same; an
    active concurrence must keep its children, for a new one would never have begun.

    Returns:
        paths, and for edges ``path: event``.

    """
    net = machine.net
    gone = [net.nodes[n].path for n in configuration.active if not _same(machine, changed, net.nodes[n].path)]
    parked = tuple((net.edges[i].state, net.edges[i].event) for i in configuration.parked)
    gone += [f"{path}: {event}" for path, event in (*parked, *needed) if not changed.has_edge(path, event)]
    at_work = (*configuration.active, *(net.source[i] for i in configuration.parked))
    around = sorted({container for n in at_work for container in net.containers(n)})
    gone += [net.nodes[n].path for n in around if not _same(machine, changed, net.nodes[n].path)]
    return tuple(dict.fromkeys(gone))


def _same(machine: Machine, changed: Machine, path: str) -> bool:
    """Is it still there, and does the same run in it?"""
    if path not in changed.net.by_path:
        return False
    one, other = machine.state(path), changed.state(path)
    if isinstance(one, State) and isinstance(other, State):
        return (one.program, one.manual, one.decides) == (other.program, other.manual, other.decides)
    if isinstance(one, Concurrence) and isinstance(other, Concurrence):
        return {child.name for child in one.states} == {child.name for child in other.states}
    return isinstance(one, Group) and isinstance(other, Group)
