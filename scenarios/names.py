"""The names a scenario may use, each with what it stands for.

What is made of a name is registered apart, because shell completion reads this file at every key press: robots in
``teleop_sim.robot.robots``, tasks in ``teleop_sim.scenarios.objects``, policies in ``teleop_sim.operators.registry``. A
test keeps them alike; error messages and the JSON Schema follow.
"""

from __future__ import annotations

from collections.abc import Mapping

ROBOTS: Mapping[str, str] = {
    "atlas": "Boston Dynamics Atlas v5, as in the DARPA Robotics Challenge",
    "thormang3": "ROBOTIS THORMANG3, as in the DARPA Robotics Challenge; 1.4 m, short steps",
    "valkyrie": "NASA Valkyrie R5, as in the Space Robotics Challenge",
}

HANDS: Mapping[str, str] = {
    "cage": "one jaw of bars a hand, as every robot has by default",
    "claw": "a cage that closes to 12 mm: round a lever, or shut as a rod",
    "fingers": "the robot's own fingers, of Valkyrie and Atlas",
    "pads": "two flat pads a hand",
}

TASKS: Mapping[str, str] = {
    "drc-door": "DARPA Robotics Challenge: turn a door's lever past its latch and push the door open",
    "drc-valve": "DARPA Robotics Challenge: turn a valve's wheel by 360 degrees",
    "src-dish": "Space Robotics Challenge task 1: align the communication dish with two crank wheels",
}

LAYERS: Mapping[str, str] = {
    "behaviour": "a state machine runs at the field site; people confirm, decide and help",
    "template": "no behaviour: a person orders each step with an object template, and moves the hand where that fails",
}

PACINGS: Mapping[str, str] = {
    "wpi": "with the fixed waits, polling and sensor sweeps of WPI's program",
    "eager": "without them: each step starts as soon as the one before is done",
}

POLICIES: Mapping[str, str] = {
    "adaptive": "the level of autonomy follows the link's round trips and the behaviour's failures",
    "collaborate": "people decide by a table of what is sensible, look where it may be wrong, act where it fails",
    "step_down": "a state that fails repeatedly is done by hand, a layer lower each time, and handed back",
    "supervise": "a fixed level; what is suggested is confirmed, a table says which command helps",
    "verify": "as supervise, but what the robot claims to see is compared with its picture, and may be rejected",
}

AUTONOMY: Mapping[str, int] = {"off": 0, "low": 1, "high": 2, "full": 3}
"""Level of the guard: an outcome passes by itself if its threshold is below the level."""

WORLDS = (1, 2, 3, 4, 5)
"""The five final worlds of the Space Robotics Challenge, the same for every team."""
