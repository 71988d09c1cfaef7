"""Whether a machine that runs may be changed now, and what comes of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.modify import Patch, apply, vanishing
from teleop_sim.machines.net import Configuration
from teleop_sim.machines.visits import Visit


def renewed(machine: Machine, patch: Patch, now: Configuration, visits: Sequence[Visit]) -> Machine | str:
    """The changed machine, or in words why it may not be changed.

    Refused are patches of another version, results that the checks refuse, what would take away something that is at
    work, suggested or held, and everything while a decided outcome waits for the robot to come to rest.
    """
    decided = next((f"{v.path} {v.chosen()}" for v in visits if v.chosen()), "")
    if decided:
        return f"too late: {decided} is decided"
    try:
        changed = apply(machine, patch)
    except TeleopError as problem:
        return str(problem).splitlines()[0]
    gone = vanishing(machine, changed, now, tuple(_needed(machine, visits)))
    return f"would vanish while at work: {', '.join(gone)}" if gone else changed


def _needed(machine: Machine, visits: Sequence[Visit]) -> Iterator[tuple[str, str]]:
    """Outcomes that are suggested, held or raised, or that a running program may come to: (path, event)."""
    for visit in visits:
        if visit.busy:
            yield from ((edge.state, edge.event) for edge in machine.outcomes_of(visit.path))
        events = (visit.pending.event if visit.pending else "", visit.held.event if visit.held else "", visit.raised)
        yield from ((visit.path, event) for event in events if event)
