"""``python -m teleop_sim``: the command line."""

from teleop_sim.cli import main

main()
