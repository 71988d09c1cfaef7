"""Pictures of the robot when each state's motion was over."""

from __future__ import annotations

from teleop_sim.core.errors import BadInput, LogDamaged
from teleop_sim.reports.parts import Picture, Pictures
from teleop_sim.reports.run_view import Run


def stills_pictures(run: Run) -> Pictures | None:
    """Stills in order; where nothing can be drawn a note says why. None where the log's plant cannot be rebuilt."""
    # MuJoCo and OpenGL are loaded only for this.
    from teleop_sim.replay.stills import stills
    from teleop_sim.world.drawing import CannotDraw

    try:
        found = stills(run.log)
    except CannotDraw as error:
        return Pictures((), f"No pictures: {error.args[0]}. {error.args[1]}")
    except (BadInput, LogDamaged):
        return None
    pictures = tuple(Picture(still.data, "image/jpeg", still.caption) for still in found)
    note = "The robot when the motion was over, once for each stay in a state in which anything moved."
    return Pictures(pictures, note) if pictures else None
