"""From a sweep to a figure: mean completion time against latency, a line a level of autonomy, with 95 % intervals.

teleop-sim sweep src-dish --latency 0s,2s,5s,10s --autonomy off,low,full --runs 20 --out runs/latency
python examples/sweep_to_figure.py runs/latency latency.svg
"""

import sys

import matplotlib.pyplot as plt

import teleop_sim
from teleop_sim.stats.summary import summary

runs = teleop_sim.load_sweep(sys.argv[1])
cells = summary(runs, ["latency_s", "autonomy"])
figure, axes = plt.subplots(figsize=(4.5, 3.2), layout="constrained")
for level, rows in cells.groupby("autonomy", sort=False):
    spread = [rows["mean_s"] - rows["mean_s_low"], rows["mean_s_high"] - rows["mean_s"]]
    axes.errorbar(rows["latency_s"], rows["mean_s"], spread, marker="o", capsize=3, label=level)
axes.set(xlabel="one-way delay [s]", ylabel="completion time [s]", ylim=(0, None))
axes.legend(title="autonomy")
figure.savefig(sys.argv[2])
