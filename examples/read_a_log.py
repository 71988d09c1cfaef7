"""What a log holds, as pandas tables: ``python examples/read_a_log.py runs/src-dish_seed1.mcap``."""

import sys

import teleop_sim

if len(sys.argv) != 2:
    sys.exit("usage: python examples/read_a_log.py LOG, such as runs/src-dish_seed1.mcap")
log = teleop_sim.load(sys.argv[1])

print("The run")
print(log.runs.T.to_string(header=False))

print("\nTime in each state")
left_s = log.transitions["t_s"]
taken = log.transitions.assign(time_s=left_s.diff().fillna(left_s))
print(taken.groupby("state", sort=False)["time_s"].agg(["count", "sum"]).to_string())

print("\nMean waits of delivered packets [s]")
arrived = log.packets[log.packets["outcome"] == "delivered"]
waits = ["queue_s", "blackout_s", "serialisation_s", "propagation_s"]
print(arrived.groupby(["direction", "topic"])[waits].mean().to_string())

print("\nBlackouts")
print(log.blackouts.to_string(index=False))
