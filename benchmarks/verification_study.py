"""What a second look is worth: levels of autonomy against delay, where detection is good and where it is not.

``python benchmarks/verification_study.py SCENARIO POLICY FIRST LAST`` runs replicates FIRST to LAST of every cell and
prints a CSV line for each: scenario, policy, replicate, level, one-way delay [s], outcome, time [s], round trips,
rejections.
Event-only but for about one physical run a level and replicate: the memo is shared by the delays.
"""

from __future__ import annotations

import sys

from teleop_sim.core.records import Judged
from teleop_sim.robot.memo import Memo
from teleop_sim.run import simulate
from teleop_sim.scenarios.files import load_scenario

LEVELS = ("off", "low", "high", "full")
DELAYS_S = (0.0, 2.0, 5.0, 10.0)


def main() -> None:
    """Run the cells, replicate by replicate."""
    name, policy, first, last = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    for replicate in range(first, last + 1):
        memo = Memo()
        for level in LEVELS:
            for delay_s in DELAYS_S:
                told = {"autonomy": level, "operator.policy": policy}
                told |= {f"link.{way}.delay_s": delay_s for way in ("up", "down")}
                done = simulate(load_scenario(name, told), 1, replicate, lambda _: None, memo=memo)
                ended = done.ended
                refused = sum(isinstance(r, Judged) and r.verdict == "rejected" for r in done.records)
                cell = f"{name},{policy},{replicate},{level},{delay_s:g}"
                print(f"{cell},{ended.outcome},{ended.t_s:.1f},{ended.round_trips},{refused}", flush=True)


if __name__ == "__main__":
    main()
