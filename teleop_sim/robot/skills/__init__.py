"""Skills by command. A new skill is one file and one line here."""

from __future__ import annotations

from teleop_sim.robot.commands import (
    Act,
    Detect,
    Follow,
    Grip,
    Look,
    Nudge,
    Posture,
    Reach,
    Release,
    Scan,
    Step,
    Stop,
    Walk,
)
from teleop_sim.robot.skill import Skill
from teleop_sim.robot.skills.act import act
from teleop_sim.robot.skills.follow import follow
from teleop_sim.robot.skills.grip import grip
from teleop_sim.robot.skills.nudge import nudge
from teleop_sim.robot.skills.posing import look, posture
from teleop_sim.robot.skills.reach import reach
from teleop_sim.robot.skills.release import release
from teleop_sim.robot.skills.sensing import detect, scan
from teleop_sim.robot.skills.walking import step, stop, walk

SKILLS: dict[type, Skill] = {
    Act: act,
    Detect: detect,
    Follow: follow,
    Grip: grip,
    Look: look,
    Nudge: nudge,
    Posture: posture,
    Reach: reach,
    Release: release,
    Scan: scan,
    Step: step,
    Stop: stop,
    Walk: walk,
}
