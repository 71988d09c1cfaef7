"""Skills by command. A new skill is one file and one line here."""

from __future__ import annotations

from teleop_sim.robot.commands import Look, Posture, Step, Stop, Walk
from teleop_sim.robot.skill import Skill
from teleop_sim.robot.skills.posing import look, posture
from teleop_sim.robot.skills.walking import step, stop, walk

SKILLS: dict[type, Skill] = {
    Look: look,
    Posture: posture,
    Step: step,
    Stop: stop,
    Walk: walk,
}
