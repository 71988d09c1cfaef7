"""A hand that holds a handle lets go before a foot moves, even when an operator stops it from letting go."""

from teleop_sim.robot.commands import CircularAffordance, Command, Release
from teleop_sim.robot.programs.pacing import pacing
from teleop_sim.robot.programs.src_dish import dish_programs
from teleop_sim.robot.programs.steps import Memory, Reply

HANDLE = CircularAffordance((2.0, 0.2, 0.81), (-0.5, 0.0, 0.866), (0.0, 1.0, 0.0), 0.123, 0.082, 0.0)


def test_a_release_that_was_stopped_is_done_again_before_anything_else() -> None:
    memory = Memory({"holding": ("left", HANDLE)})
    program = dish_programs(pacing("eager"))["STATE_INIT"](memory)
    done: list[Command] = []
    step = next(program)
    for outcome in ("stopped", "stopped", "reached"):
        assert isinstance(step, Release)
        assert memory.facts["holding"] is not None
        done.append(step)
        step = program.send(Reply(outcome, "", None, 1.0))
    assert not isinstance(step, Release)
    assert memory.facts["holding"] is None
