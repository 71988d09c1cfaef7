"""The run's machine as it was used: states with their time and worst mode, outcomes with their counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from teleop_sim.core.errors import TeleopError
from teleop_sim.core.records import Record, TransitionTaken
from teleop_sim.reports.parts import Column, Drawing, Sheet
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.visits import visits, worst

if TYPE_CHECKING:
    from teleop_sim.machines.declare import Machine
    from teleop_sim.machines.draw_visits import Seen


def machine_drawing(run: Run) -> Drawing | Sheet | None:
    """The machine with its visits; without Graphviz's program ``dot`` the same as a table.

    None where the log has no transitions, does not say which machine it was, or today's version does not know that one.
    """
    from teleop_sim.machines.draw_file import can_draw

    machine = machine_of_run(run)
    if machine is None or not any(isinstance(r, TransitionTaken) for r in run.records):
        return None
    seen = seen_in(run.records)
    if not can_draw():
        return transitions_sheet(seen)
    longest = sorted(seen.stays.items(), key=lambda item: -item[1].time_s)[:3]
    words = ", ".join(f"{path} {stay.time_s:.0f} s" for path, stay in longest)
    note = (
        "Colour of a state: the worst mode that it needed; of a line: who let the outcome pass; its width: how often. "
        "Bold frame: where the run ended."
    )
    return Drawing(
        lambda suffix: _rendered(machine, seen, suffix), f"State machine with visits; longest: {words}.", note
    )


def transitions_sheet(seen: Seen) -> Sheet:
    """A row an outcome that was taken, with its counts by who let it pass."""
    from teleop_sim.machines.draw_visits import HOW_COLOURS

    columns = (
        Column("state", "state"),
        Column("outcome", "outcome"),
        *(Column(how, how) for how in HOW_COLOURS),
        Column("time_s", "time in the state [s]", 1, help="over all visits"),
    )
    rows = tuple(
        (
            state,
            event,
            *(ways.get(how, 0) for how in HOW_COLOURS),
            seen.stays[state].time_s if state in seen.stays else None,
        )
        for (state, event), ways in seen.taken.items()
    )
    return Sheet(columns, rows, (), "Its drawing needs Graphviz's program dot, which is not installed here.")


def machine_of_run(run: Run) -> Machine | None:
    """The machine of a run's scenario; None where it is not known."""
    if not run.scenario:
        return None
    # Robots and their worlds are loaded only for this.
    from teleop_sim.scenarios.files import read_scenario
    from teleop_sim.scenarios.objects import machine_of

    try:
        return machine_of(read_scenario(run.log.scenario_toml, str(run.log.path)))
    except (TeleopError, KeyError):
        return None


def seen_in(records: Sequence[Record]) -> Seen:
    """Stays and transitions of a run."""
    from teleop_sim.machines.draw_visits import Seen, Stay

    run = visits(records)
    names = dict.fromkeys(v.state for v in run)
    stays = {
        name: Stay(
            sum(v.time_s for v in run if v.state == name),
            sum(v.state == name for v in run),
            worst(v.mode for v in run if v.state == name),
        )
        for name in names
    }
    taken: dict[tuple[str, str], dict[str, int]] = {}
    for r in records:
        if isinstance(r, TransitionTaken):
            ways = taken.setdefault((r.state, r.event), {})
            ways[r.how] = ways.get(r.how, 0) + 1
    return Seen(stays, taken, run[-1].state if run else "")


def _rendered(machine: Machine, seen: Seen, suffix: str) -> bytes:
    from teleop_sim.machines.draw_file import drawn
    from teleop_sim.machines.draw_visits import visits_dot

    return drawn(visits_dot(machine, seen), suffix)
