"""A machine that does nothing itself: a person works with templates and hands from beginning to end.

For the paper's runs without a behaviour (Romay et al., sections 6.2.1 and 6.2.3). It stands in a behaviour's place,
so that levels, requests, logs and reports are those of every other run.
"""

from __future__ import annotations

from functools import cache

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Autonomy, Edge, State

OPERATE = "Operate"
"""The state that is in a person's hands from the start: its request is of kind ``act``."""


@cache
def operator_only() -> Machine:
    """One state, and what the person says in the end: ``done`` or ``failed``."""
    return Machine(
        "operator_only",
        OPERATE,
        (State(OPERATE, manual=True, action="a person does the task", parameters=(("request", "act"),)),),
        (
            Edge(OPERATE, "done", "finished", Autonomy.FULL, "done", "operator"),
            Edge(OPERATE, "failed", "failed", Autonomy.FULL, "failed", "operator"),
        ),
        outcomes=("finished", "failed"),
        goals=frozenset({"finished"}),
    )
