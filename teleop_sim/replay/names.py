"""Words for people, and for shell completion, which loads nothing else."""

CAMERA_NAMES = {
    "behind": "follows the robot, over the shoulder that is nearer to the thing",
    "side": "follows the robot, from the side on which the thing is",
    "station": "stays where it sees all of the way and the thing",
}
"""Name of a camera to where it is."""
