"""What can be said of a machine without running it: reachability, dead ends, keys, attempts, loops."""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.machines.analysis_keys import Unwritten, unwritten
from teleop_sim.machines.analysis_loops import Loop, longest, loops
from teleop_sim.machines.analysis_ways import ways
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import State


@dataclass(frozen=True)
class Report:
    """What was found. States are named by path.

    Attributes:
        machine: its name.
        states: how many, containers not counted.
        by_hand: states that are reached only if a person forces an outcome.
        unreachable: states that no way reaches at all.
        dead_ends: states from which nothing leads on, whatever people do.
        stuck: states from which nothing leads on unless a person acts.
        silent: outcomes that a container declares and never comes to, as (container, outcome); the machine's own
            have an empty path.
        unraised: outcomes that nobody raises, as (state, event).
        unwritten: keys that are read on some way on which nothing has written them.
        attempts: failures in a row until the last counter of a signal is full, as (state, signal, attempts).
        loops: along which programs may go round for ever.
        longest: most outcomes in a row without a person; None if a loop goes on for ever or they could not be counted.

    """

    machine: str
    states: int
    by_hand: tuple[str, ...]
    unreachable: tuple[str, ...]
    dead_ends: tuple[str, ...]
    stuck: tuple[str, ...]
    silent: tuple[tuple[str, str], ...]
    unraised: tuple[tuple[str, str], ...]
    unwritten: tuple[Unwritten, ...]
    attempts: tuple[tuple[str, str, int], ...]
    loops: tuple[Loop, ...]
    longest: int | None

    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """All of it as a table: (what, where, which)."""
        bound = "unlimited" if self.loops else "not counted" if self.longest is None else str(self.longest)
        return (
            *(("unreachable", path, "") for path in self.unreachable),
            *(("dead end", path, "") for path in self.dead_ends),
            *(("only reached by hand", path, "") for path in self.by_hand),
            *(("stuck without a person", path, "") for path in self.stuck),
            *(("never comes", path or self.machine, outcome) for path, outcome in self.silent),
            *(("nobody raises", path, event) for path, event in self.unraised),
            *(("may be unwritten", u.path, f"{u.own} ({u.key})" if u.own != u.key else u.own) for u in self.unwritten),
            *(("attempts", path, f"{signal} {n}") for path, signal, n in self.attempts),
            *(("loop without end", loop[0].state, _way(loop)) for loop in self.loops),
            ("outcomes in a row at most", self.machine, bound),
        )

    def __str__(self) -> str:
        rows = self.rows()
        widths = [max(len(row[k]) for row in rows) for k in (0, 1)]
        return "\n".join(f"{a:{widths[0]}s}  {b:{widths[1]}s}  {c}".rstrip() for a, b, c in rows)


def analyse(machine: Machine) -> Report:
    """Everything that is found without running a machine. A moment for a few hundred states."""
    with_people = ways("", machine.top, (), machine.ends, people=True)
    alone = ways("", machine.top, (), machine.ends, people=False)
    leaves = {n.path: n.element for n in machine.net.nodes if isinstance(n.element, State)}
    return Report(
        machine=machine.name,
        states=len(leaves),
        by_hand=tuple(path for path in with_people.reached if path not in alone.reached),
        unreachable=tuple(path for path in machine.state_names if path not in with_people.reached),
        dead_ends=tuple(path for path in with_people.dead if path not in machine.ends),
        stuck=tuple(path for path in alone.dead if path not in (*with_people.dead, *machine.ends)),
        silent=with_people.silent,
        unraised=tuple((e.state, e.event) for e in machine.table if e.state in leaves and e.raised_by == "nobody"),
        unwritten=unwritten(machine.top),
        attempts=tuple((path, row.signal, row.attempts) for path, leaf in leaves.items() for row in leaf.rows),
        loops=loops(machine),
        longest=longest(machine),
    )


def _way(loop: Loop) -> str:
    return " ".join(f"–{edge.event}→ {edge.next_state}" for edge in loop)
