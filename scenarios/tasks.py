"""What a task is: a world with a scorer, a machine, and what each of its states does. The list is in ``objects.py``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from teleop_sim.machines.declare import Machine
from teleop_sim.robot.programs.pacing import Pacing
from teleop_sim.robot.programs.steps import ProgramOf
from teleop_sim.scenarios.links import Streams
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.world.disturbance_draw import Ground
from teleop_sim.world.drc_draw import Placed
from teleop_sim.world.plant import Scenery
from teleop_sim.world.scoring import Score


@dataclass(frozen=True)
class Site:
    """Where a task is done, as drawn.

    Attributes:
        scenery: what stands round the robot.
        score: to begin with, by the plant's joints.
        ground: where the robot is to walk, and how rough it is there.
        thing: that templates are laid over, if the task has one.
    """

    scenery: Scenery
    score: Callable[[tuple[str, ...]], Score]
    ground: Ground
    thing: Placed | None = None


@dataclass(frozen=True)
class Task:
    """One task.

    Attributes:
        machine: declares what is done in which order, for a robot by name, at a layer of control.
        programs: what each state of the machine does, with the given waits, for a robot by name.
        site: draws the world.
        last_checkpoint: of the scorer; the task is done when it has been scored.
        ends_when_scored: the run ends there; else when the machine has ended, too.
        template: that people lay over the thing, by its name in the library.

    """

    machine: Callable[[str, str], Machine]
    programs: Callable[[Pacing, str], Mapping[str, ProgramOf]]
    site: Callable[[Scenario, Streams], Site]
    last_checkpoint: int
    ends_when_scored: bool = False
    template: str = ""
