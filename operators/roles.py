"""Who answers what: four roles, and how one to four people share them.

Source: A. Romay et al., Collaborative Autonomy Between High-level Behaviors and Human Operators for Remote Manipulation
Tasks using Different Humanoid Robots, Table 1 and section 5.2. ViGIR had four people; Hector three, none immersed.
"""

from __future__ import annotations

from typing import Final, Literal

from teleop_sim.channel.messages import Request
from teleop_sim.machines.declare import Machine

Role = Literal["supervisor", "primary", "auxiliary", "immersed"]

ROLES: Final[tuple[Role, ...]] = ("supervisor", "primary", "auxiliary", "immersed")

TEAMS: Final[dict[int, tuple[tuple[Role, ...], ...]]] = {
    1: (ROLES,),
    2: (("supervisor", "immersed"), ("primary", "auxiliary")),
    3: (("supervisor",), ("primary",), ("auxiliary", "immersed")),
    4: (("supervisor",), ("primary",), ("auxiliary",), ("immersed",)),
}
"""Roles of each person by the size of the crew. Three and four are the paper's teams, but that Hector had nobody
immersed: his part falls to who gathers perception data. How two share is assumed: who decides, and who acts."""

_GOAL, _PLAN = "WAYPOINT_GOAL_POSE", "FOOTSTEP_PLAN_HEADER"
"""What FlexBE's input states ask for, as the parameter ``request`` of ViGIR's states says."""


def role_of(machine: Machine, request: Request) -> Role:
    """The role that answers a request.

    The supervisor confirms, decides and helps a machine that gave up; the primary operator acts in lieu of a state and
    gives goals to walk to; the auxiliary operator gives templates and looks over footstep plans.
    """
    if request.kind == "act":
        return "primary"
    wanted = dict(machine.leaf(machine.net.nodes[request.node].path).parameters).get("request")
    if request.kind == "data":
        return "primary" if wanted == _GOAL else "auxiliary"
    if request.kind == "confirm" and (wanted == _PLAN or plans_steps(machine, request)):
        return "auxiliary"
    return "supervisor"


def plans_steps(machine: Machine, request: Request) -> bool:
    """Does the request come from a state that plans footsteps?"""
    return machine.leaf(machine.net.nodes[request.node].path).program.startswith("PlanFootsteps")
