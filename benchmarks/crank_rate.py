"""How fast robots turn a crank: thread CPU time of reach, grip, follow and release against a bare loop of MuJoCo.

python benchmarks/crank_rate.py [--repeats 5] [--robots valkyrie,atlas]

As ``physics_rate.py``: the bare loop gets the same controls from the same state and ends in it to the last bit. A table is
timed without its memory, as the first command at a wheel meets it; episodes with it, as all others do.
"""

from __future__ import annotations
