"""One operator with object templates against a behaviour with three, at the DRC door, in pandas.

python examples/drc_door.py 5

runs five seeds of each, keeps their logs in ``runs/drc_door`` and prints where the time went.
"""

import sys
from pathlib import Path

import pandas as pd

import teleop_sim
from teleop_sim.reports.drc_marks import counts
from teleop_sim.reports.drc_times import drc_times, paper_rows

if len(sys.argv) != 2 or not sys.argv[1].isdecimal():
    sys.exit("usage: python examples/drc_door.py SEEDS, such as 5")
rows, work = [], []
for name in ("drc-door-lab-operator", "drc-door-lab-behaviour"):
    for seed in range(1, int(sys.argv[1]) + 1):
        result = teleop_sim.run_scenario(teleop_sim.load_scenario(name), seed, Path("runs/drc_door"))
        log = teleop_sim.load(result.log)
        records = list(log.records())
        told = {"scenario": name, "seed": seed, "completed": result.outcome == "completed"}
        rows.append(told | vars(drc_times(records)) | counts(records))
        work.append(log.layers.assign(scenario=name, seed=seed))
runs, layers = pd.DataFrame(rows), pd.concat(work, ignore_index=True)

print("Columns of the ViGIR paper's Table 2 [s], means of completed runs, and the paper's one run")
columns = list(vars(paper_rows()["drc-door-lab-operator"].times))
means = runs[runs["completed"]].groupby("scenario", sort=False)[columns].mean()
paper = pd.DataFrame({f"{name} (paper)": vars(paper_rows()[name].times) for name in means.index}).T
print(pd.concat([means, paper]).round(0).to_string())
if len(means) == 2:
    print(f"\noperator only over behaviour: {means['overall_s'].iloc[0] / means['overall_s'].iloc[1]:.2f} (paper 1.76)")

print("\nWork of the crew at the layers [s a run]")
layers["work_s"] = layers["t_s"] - layers["start_s"]
spent = layers.groupby(["scenario", "layer"], sort=False)["work_s"].sum() / runs["seed"].nunique()
print(spent.round(1).to_string())

print("\nWhat the crew did besides confirming, a run")
print(runs.groupby("scenario", sort=False)[list(counts([]))].mean().to_string())
