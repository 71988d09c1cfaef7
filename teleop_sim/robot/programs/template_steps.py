"""The steps of the manipulation workflow of object templates, for behaviours and people alike.

Source: Romay et al., Collaborative Autonomy Between High-level Behaviors and Human Operators for Remote Manipulation
Tasks using Different Humanoid Robots, section 3.3 and Figure 4: stand pose, pre-grasp, open fingers, grasp, close
fingers, attach, usability, affordance; here with detach, release and home, by which the hand comes back.

``step_program`` yields commands and returns what came of the step. It keeps what the hand holds and how far the thing
has gone in ``Memory.facts["work"]``, so that a step ordered by a person goes on where a behaviour's has ended.

Not modelled: things that come along with the hand (nothing here is attached, and a usability is the tool itself);
templates other than a door and a valve; the right hand.
"""

from __future__ import annotations

from teleop_sim.robot.programs import template_hands as hands
from teleop_sim.robot.programs.steps import Memory, StepName
from teleop_sim.robot.programs.template_affordances import affordance
from teleop_sim.robot.programs.template_work import (
    Down,
    Instance,
    StepOutcome,
    StepProgram,
    hand_moved,
    instance_of,
)

__all__ = ["Instance", "StepOutcome", "StepProgram", "hand_moved", "instance_of", "step_program"]


def step_program(name: StepName, at: Instance, which: int, amount: float, memory: Memory) -> StepProgram:
    """One step.

    Args:
        name: which. at: the template, and whose hand.
        which: id of the affordance or (pre-)grasp in the library; a small number of a (pre-)grasp is its place from 0.
        amount: of an affordance in its own sense [m or rad]; zero: what it does by itself.
        memory: of the field computer.

    """
    why = at.refusal()
    if why:
        return StepOutcome("refused", 0.0, why)
    try:
        return (yield from _step(name, at, which, amount, memory))
    except Down as down:
        return StepOutcome("fell", 0.0, str(down))


def _step(name: StepName, at: Instance, which: int, amount: float, memory: Memory) -> StepProgram:
    match name:
        case "stand":
            return (yield from hands.stand(memory, at))
        case "pregrasp":
            return (yield from hands.pregrasp(memory, at, at.preferred(which)))
        case "grasp":
            return (yield from hands.grasp(memory, at))
        case "open" | "close":
            return (yield from hands.fingers(memory, at, name == "close"))
        case "affordance":
            return (yield from affordance(memory, at, which, amount))
        case "release":
            return (yield from hands.release(memory, at))
        case "home":
            return (yield from hands.home(memory, at))
        case "detach" | "usability":
            return StepOutcome("reached", 0.0, "the hand itself is the tool")
    return StepOutcome("refused", 0.0, f"a {at.template} does not come along with the hand")
