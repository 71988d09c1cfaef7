"""Skills by command. A new skill is one file and one line here."""

from __future__ import annotations

from teleop_sim.robot.commands import Detect, Look, Posture, Scan, Step, Stop, Walk
from teleop_sim.robot.skill import Skill
from teleop_sim.robot.skills.posing import look, posture
from teleop_sim.robot.skills.sensing import detect, scan
from teleop_sim.robot.skills.walking import step, stop, walk

SKILLS: dict[type, Skill] = {
    Detect: detect,
    Look: look,
    Posture: posture,
    Scan: scan,
    Step: step,
    Stop: stop,
    Walk: walk,
}
