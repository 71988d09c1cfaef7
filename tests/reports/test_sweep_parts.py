"""What the parts of a sweep's report say equals what is counted from its table of runs by other means."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from teleop_sim.reports.formats.files import made_of
from teleop_sim.reports.parts import Chart
from teleop_sim.reports.registry import SWEEP_PARTS
from teleop_sim.reports.shares import SHARES
from teleop_sim.reports.style import drawn, paper
from teleop_sim.reports.sweep_causes import causes, examples, kind
from teleop_sim.reports.sweep_cells import MOST_ROWS, cells, picked_runs
from teleop_sim.reports.sweep_curves import MOST_POINTS, completion, probability
from teleop_sim.reports.sweep_effects import effects
from teleop_sim.reports.sweep_maps import decision, heat
from teleop_sim.reports.sweep_page import facts, sweep_html, verdict
from teleop_sim.reports.sweep_states import state_levels, states, times
from teleop_sim.reports.sweep_survival import MOST_STEPS, drawn_steps, survival
from teleop_sim.reports.sweep_where import where
from teleop_sim.stats.decision import decision_map
from teleop_sim.stats.runs import Measure

DELAYS, LEVELS = (0.0, 2.0, 10.0), ("off", "low", "full")
AXES = {"uplink_bps": (64.0, 4000.0), "latency_s": DELAYS, "autonomy": LEVELS}


@pytest.fixture(scope="module")
def sweep(made):
    return made(AXES, replicates=8)


@pytest.fixture(scope="module")
def made():
    from pathlib import Path
    from runpy import run_path

    return run_path(str(Path(__file__).with_name("conftest.py")))["made_sweep"]


def as_frame(sheet) -> pd.DataFrame:
    return pd.DataFrame(sheet.rows, columns=[column.name for column in sheet.columns])


def shown(chart):
    """The figure of a chart, laid out."""
    with paper():
        figure = chart.draw()
        figure.draw_without_rendering()
    return figure


def test_every_part_has_a_name_of_its_own_and_a_title():
    assert len({part.name for part in SWEEP_PARTS}) == len(SWEEP_PARTS)
    assert all(part.title for part in SWEEP_PARTS)


def test_cells_are_what_pandas_and_scipy_say(sweep):
    table = as_frame(cells(sweep)).set_index(["uplink_bps", "latency_s", "autonomy"])
    assert len(table) == 18
    groups = sweep.runs.groupby(["uplink_bps", "latency_s", "autonomy"])
    for key, rows in groups:
        row, done = table.loc[key], rows["status"] == "completed"
        interval = stats.binomtest(int(done.sum()), len(rows)).proportion_ci(method="wilson")
        assert row["runs"] == len(rows)
        assert row["completion_pct"] == pytest.approx(100 * done.mean())
        assert row["completion_low_pct"] == pytest.approx(100 * interval.low)
        assert row["completion_high_pct"] == pytest.approx(100 * interval.high)
        assert row["failed"] == (rows["status"] == "failed").sum()
        restricted = rows["time_s"].where(done, 1800.0)
        assert row["mean_s"] == pytest.approx(restricted.mean())
        # Without early censoring the interval is Student's of the restricted times.
        low, high = stats.t.interval(0.95, len(rows) - 1, restricted.mean(), stats.sem(restricted))
        assert (row["mean_s_low"], row["mean_s_high"]) == pytest.approx((max(low, 0.0), min(high, 1800.0)))
        for name in SHARES:
            assert row[name] == pytest.approx(rows[name].mean())
        assert sum(row[name] for name in SHARES) == pytest.approx(rows["time_s"].mean())


def test_a_median_that_was_not_reached_is_left_empty(made):
    table = as_frame(cells(made({"autonomy": LEVELS}, fails=0.9, seed=3)))
    assert table["q50_s"].isna().any()


def test_best_median_and_worst_are_picked_by_outcome_then_time(sweep):
    picked = picked_runs(sweep.runs)
    rank = {"completed": 0, "censored": 1, "failed": 2}
    for cell, rows in sweep.runs.groupby("cell"):
        ordered = sorted(
            rows.to_dict("records"),
            key=lambda r: (rank[r["status"]], 0 if r["status"] == "completed" else -r["score"], r["time_s"]),
        )
        wanted = {"best": ordered[0], "median": ordered[(len(ordered) - 1) // 2], "worst": ordered[-1]}
        assert {name: run["replicate"] for name, run in picked[cell].items()} == {
            name: run["replicate"] for name, run in wanted.items()
        }


def test_cells_link_to_logs_and_to_pages_where_there_are_some(sweep):
    sheet = cells(replace(sweep, to_logs="../s p/", pages=frozenset({"runs/c0000/r00000.html"})))
    assert len(sheet.links) == 3 * len(sheet.rows)
    column = [column.name for column in sheet.columns].index("best_run")
    replicate = int(str(sheet.rows[5][column])[1:])
    assert sheet.links[5, column] == f"../s%20p/runs/c0005/r{replicate:05d}.mcap"
    pages = [address for address in sheet.links.values() if address.endswith(".html")]
    assert set(pages) <= {"../s%20p/runs/c0000/r00000.html"}


def test_without_logs_nothing_is_linked(sweep):
    bare = replace(sweep, runs=sweep.runs.assign(log=""), detail="summary")
    assert not cells(bare).links
    assert "kept no logs" in cells(bare).note


def test_more_cells_than_a_page_can_hold_are_said_to_be_left_out(made):
    many = made({"world.layout": tuple(range(MOST_ROWS + 5))}, replicates=1)
    sheet = cells(many)
    assert len(sheet.rows) == MOST_ROWS
    assert f"The first {MOST_ROWS} of {MOST_ROWS + 5} cells" in sheet.note


def lines_of(axes) -> list[tuple[np.ndarray, np.ndarray]]:
    return [container[0].get_data() for container in axes.containers]


@pytest.mark.parametrize(("part", "column"), [(completion, "mean_s"), (probability, "completion")])
def test_curves_go_through_the_cells(sweep, part, column):
    figure = shown(part(sweep))
    # A row against the uplink, a panel a delay; a row against the delay, a panel an uplink.
    assert len(figure.axes) == 3 + 2
    panel = figure.axes[1]
    assert panel.get_title() == "one-way delay 2 s"
    cells_there = sweep.table[sweep.table["latency_s"] == 2.0]
    factor = 100.0 if column == "completion" else 1.0
    for level, (x, y) in zip(LEVELS, lines_of(panel), strict=True):
        wanted = cells_there[cells_there["autonomy"] == level].sort_values("uplink_bps")
        assert y == pytest.approx(factor * wanted[column].to_numpy())
        # Lines stand beside each other by 1.4 % of the axis.
        assert np.log(x) == pytest.approx(np.log(wanted["uplink_bps"]), abs=0.03 * math.log(4000 / 64))


def test_curves_of_other_designs_are_points_of_all_cells(made):
    axes = {"uplink_bps": (64.0, 300.0, 900.0), "latency_s": (1.0, 4.0, 2.0), "autonomy": ("off", "full", "off")}
    made_up = made(axes, design="lhs:3")
    chart = completion(made_up)
    panels = shown(chart).axes
    assert [panel.get_xlabel() for panel in panels] == ["uplink [bit/s]", "one-way delay [s]"]
    assert sum(len(x) for x, _ in lines_of(panels[0])) == 3
    assert all(container[0].get_linestyle() == "None" for container in panels[0].containers)
    assert "no grid" in chart.note


def test_of_thousands_of_cells_every_so_many_is_drawn_and_that_is_said(made):
    values = tuple(range(2 * MOST_POINTS + 1))
    chart = completion(made({"uplink_bps": values, "latency_s": values[::-1]}, 1, choose="x", design="lhs:2001"))
    assert f"Shown are 667 of {2 * MOST_POINTS + 1:,} cells" in chart.note
    assert len(lines_of(shown(chart).axes[0])[0][0]) == 667


def test_one_run_has_no_interval(made):
    panel = shown(completion(made({"latency_s": DELAYS}, replicates=1))).axes[0]
    segments = panel.containers[0][2][0].get_segments()
    assert all(segment[0, 1] == segment[1, 1] for segment in segments)


def test_survival_is_the_share_still_running_where_nobody_is_left_early(made):
    times_s = np.array([30.0, 10.0, 20.0, 40.0])
    steps = drawn_steps(times_s, np.ones(4, dtype=bool), 50.0)
    for at_s in (0.0, 10.0, 15.0, 20.0, 35.0, 39.9):
        share = steps.share[np.searchsorted(steps.times_s, at_s, side="right") - 1]
        assert share == pytest.approx((times_s > at_s).mean())
    assert steps.times_s[-1] == 40.0
    assert (steps.low <= steps.share).all()
    assert (steps.share <= steps.high).all()


def test_survival_equals_scipys_with_censoring(made):
    rng = np.random.default_rng(4)
    times_s, done = rng.exponential(100.0, 60), rng.random(60) < 0.7
    steps = drawn_steps(times_s, done, float(times_s.max()))
    theirs = stats.ecdf(stats.CensoredData.right_censored(times_s, ~done)).sf
    at_s = np.linspace(0.0, times_s.max() * 0.999, 50)
    ours = steps.share[np.searchsorted(steps.times_s, at_s, side="right") - 1]
    assert ours == pytest.approx(theirs.evaluate(at_s))


def test_a_curve_of_thousands_of_runs_is_thinned_within_a_step():
    times_s = np.random.default_rng(2).exponential(100.0, 20_000)
    steps = drawn_steps(times_s, np.ones(20_000, dtype=bool), 500.0)
    # Up to the end of the axis one a step, and what lies behind it.
    assert (steps.times_s <= 500.0).sum() <= MOST_STEPS + 3
    at_s = np.linspace(0.0, 499.0, 97)
    exact = (times_s[None, :] > at_s[:, None]).mean(axis=1)
    ours = steps.share[np.searchsorted(steps.times_s, at_s, side="right") - 1]
    # Late by one step of the axis at most: exp(-t/100) falls by 1.25 % in it.
    assert np.abs(ours - exact).max() < 0.0125 + 1e-3


def test_numbers_at_risk_stand_under_each_panel(sweep):
    figure = shown(survival(sweep))
    assert len(figure.axes) == 6
    panel = figure.axes[0]
    rows = sweep.runs[(sweep.runs["uplink_bps"] == 64.0) & (sweep.runs["latency_s"] == 0.0)]
    texts = [text.get_text() for text in panel.texts]
    at_risk_s = np.where(rows["status"] == "completed", rows["time_s"], 1800.0)
    wanted = [
        str(int((at_risk_s[rows["autonomy"] == level] >= time_s).sum()))
        for level in LEVELS
        for time_s in panel.get_xticks()
    ]
    assert texts == wanted


def test_survival_of_many_settings_shows_at_most_twelve(made):
    rates, delays = tuple(10.0 * 2.0**n for n in range(5)), tuple(float(n) for n in range(6))
    chart = survival(made({"uplink_bps": rates, "latency_s": delays, "autonomy": ("off", "full")}, replicates=2))
    assert len(shown(chart).axes) == 12
    assert "3 of 5 values of uplink and 4 of 6 values of one-way delay" in chart.note


def test_the_decision_map_is_the_one_of_the_command(sweep):
    figure = shown(decision(sweep))
    found = decision_map(sweep.runs, ["uplink_bps", "latency_s"], "autonomy", Measure("time", 1800.0), 1)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert len(texts) == len(found) == 6
    assert sorted(text.split("\n")[0] for text in texts) == sorted(found["best"])
    assert f"{(found['verdict'] != 'clear').sum()} of 6 settings" in decision(sweep).note


def test_no_decision_without_a_choice_or_a_link(made):
    assert decision(made({"latency_s": DELAYS})) is None
    assert decision(made({"autonomy": LEVELS})) is None


def test_times_are_restricted_to_what_every_run_was_watched(sweep):
    early = replace(sweep, runs=sweep.runs.assign(status=["censored", *sweep.runs["status"][1:]]))
    assert (sweep.limit_s, early.limit_s) == (1800.0, sweep.runs["time_s"][0])
    assert decision(early) is not None


def test_heat_maps_show_each_cell(sweep):
    axes = shown(heat(sweep)).axes
    assert len(axes) == 2 * len(LEVELS)
    for n, level in enumerate(LEVELS):
        rows = sweep.table[sweep.table["autonomy"] == level].sort_values(["uplink_bps", "latency_s"])
        assert [text.get_text() for text in axes[n].texts] == [f"{v:.0f}" for v in rows["mean_s"]]
        below = axes[len(LEVELS) + n]
        assert [text.get_text() for text in below.texts] == [f"{100 * v:.0f}" for v in rows["completion"]]


def test_heat_maps_need_two_factors(made):
    assert heat(made({"latency_s": DELAYS, "autonomy": LEVELS})) is None


def test_bars_are_as_long_as_the_mean_run(sweep):
    axes = shown(where(sweep)).axes
    assert len(axes) == len(DELAYS) * len(LEVELS)
    for n, (delay_s, level) in enumerate((d, level) for d in DELAYS for level in LEVELS):
        rows = sweep.runs[(sweep.runs["latency_s"] == delay_s) & (sweep.runs["autonomy"] == level)]
        wanted = rows.groupby("uplink_bps")["time_s"].mean().tolist()
        tops = [max(bar.get_y() + bar.get_height() for bar in axes[n].patches[i::2]) for i in range(2)]
        assert tops == pytest.approx(wanted)


def test_causes_are_counted_with_one_run_each(sweep):
    sheet = causes(sweep)
    table, bad = as_frame(sheet), sweep.runs[sweep.runs["status"] != "completed"]
    assert table["runs"].sum() == len(bad) == sheet.total[2]
    # Half of the made-up failures differ by a figure alone.
    assert set(table["cause"]) == {"left", "fell at … rad"}
    fell = table[table["cause"] == "fell at … rad"].iloc[0]
    assert fell["runs"] == bad["cause"].str.startswith("fell").sum()
    assert fell["cells"] == bad[bad["cause"].str.startswith("fell")]["cell"].nunique()
    assert sum(fell[f"runs_{level}"] for level in LEVELS) == fell["runs"]
    for row, run in zip(sheet.rows, examples(sweep), strict=True):
        assert row[1] == kind(run["cause"])
    assert all(address.endswith(".mcap") for address in sheet.links.values())


def test_no_causes_where_all_completed(made):
    assert causes(made(AXES, fails=0.0)) is None


STATES = [
    # cell, replicate, state, during, visits, normal, auto, manual, retries, interrupted, time_s
    (0, 0, "STATE_CORRECT_PITCH", "", 1, 1, 0, 0, 0, 1, 30.0),
    (0, 0, "STATE_REDETECT_HANDLE", "STATE_CORRECT_PITCH", 1, 1, 0, 0, 0, 0, 10.0),
    (0, 0, "STATE_ODD", "", 1, 0, 0, 1, 0, 0, 5.0),
    (1, 0, "STATE_CORRECT_PITCH", "", 2, 1, 1, 0, 3, 0, 50.0),
]
STATE_COLUMNS = ["cell", "replicate", "state", "during", "visits", "normal", "auto", "manual", "retries", "interrupted"]


def with_states(made, **given):
    states_of = pd.DataFrame(STATES, columns=[*STATE_COLUMNS, "time_s"])
    return made({"autonomy": ("off", "full")}, replicates=1, states=states_of, **given)


def test_table_ii_counts_an_interruption_where_it_interrupted(made):
    table = as_frame(states(with_states(made))).set_index("state")
    pitch = table.loc["Fix Pitch"]
    assert (pitch["runs"], pitch["retries"], pitch["time_s"]) == (2, 4, 45.0)
    # One run was interrupted, the other needed recovery: none went normally.
    assert (pitch["normal_pct"], pitch["auto_pct"], pitch["manual_pct"]) == (0.0, 100.0, 0.0)
    assert pitch["paper_time_s"] == 36.7
    assert table.loc["STATE_ODD", "manual_pct"] == 100.0


def test_states_by_level_stand_beside_each_other_and_the_paper(made):
    table = as_frame(state_levels(with_states(made))).set_index("state")
    assert table.loc["Fix Pitch", ["off_time_s", "full_time_s", "paper_time_s"]].tolist() == [40.0, 50.0, 36.7]
    assert table.loc["Fix Pitch", ["off_retries", "full_retries"]].tolist() == [1.0, 3.0]
    assert math.isnan(table.loc["STATE_ODD", "full_time_s"])


def test_a_sweep_that_kept_no_states_says_so(sweep):
    sheet = states(sweep)
    assert not sheet.rows
    assert "Sweep again" in sheet.note
    assert state_levels(sweep) is None


def test_states_of_some_runs_only_are_said_to_be(made):
    assert "2 of 6 runs" in states(replace(with_states(made), runs=made({"autonomy": ("off", "full")}, 3).runs)).note


def test_table_2_has_a_row_a_cell_and_the_papers(made):
    runs = made({"autonomy": ("off", "full")}, replicates=4, fails=0.5, seed=8, task="drc-door", name="drc-door-day1")
    kept = runs.runs[["cell", "replicate"]].copy()
    for n, name in enumerate(("overall", "alignment", "teleoperation", "template", "behaviour", "motion")):
        kept[f"{name}_s"] = runs.runs["time_s"] * (n + 1)
    sheet = times(replace(runs, times=kept))
    table = as_frame(sheet)
    done = runs.runs[runs.runs["status"] == "completed"]
    for row, (level, rows) in zip(table.to_dict("records"), done.groupby("autonomy", sort=False), strict=False):
        assert (row["row"], row["autonomy"], row["completed"], row["runs"]) == ("here", level, len(rows), 4)
        assert row["template_s"] == pytest.approx(4 * rows["time_s"].mean())
        assert row["overall_s_sd"] == pytest.approx(rows["time_s"].std(), nan_ok=True)
    # Four rows of the door in the paper.
    assert table["row"].str.startswith("ViGIR paper").sum() == 4
    assert "its row ViGIR Door Day 1" in sheet.note
    assert times(runs).rows == ()
    assert times(replace(runs, task="src-dish")) is None


def test_effects_are_sorted_by_what_matters(made, sweep):
    found = pd.DataFrame({"factor": ["uplink_bps", "latency_s"], "mu": [1.0, -9.0], "mu_star": [2.0, 9.0],
                          "mu_star_half": [0.5, 1.0], "sigma": [0.1, 0.2]})  # fmt: skip
    assert [row[0] for row in effects(replace(sweep, effects=found)).rows] == ["one-way delay", "uplink"]
    assert effects(sweep) is None


def empty(made):
    full = made(AXES)
    return replace(full, runs=full.runs.head(0), finished=False)


def unfinished(made):
    full = made(AXES)
    return replace(full, runs=full.runs.head(17), finished=False)


def refused(made):
    full = made({"loss": (0, 1)}, fails=1.0)
    return replace(full, runs=full.runs.assign(time_s=0.0))


FIVE = {"uplink_bps": (64.0, 4000.0), "latency_s": DELAYS, "loss": (0.0, 0.1), "robot": ("a", "b"), "autonomy": LEVELS}
SAMPLED = {
    "uplink_bps": tuple(64.0 + 13.0 * n for n in range(30)),
    "latency_s": tuple((7 * n % 30) / 3 for n in range(30)),
    "autonomy": LEVELS * 10,
}
SHAPES = {
    "no run": empty,
    "one run": lambda made: made({}, replicates=1, fails=0.0),
    "no factor": lambda made: made({}, replicates=5),
    "one level": lambda made: made({"autonomy": ("full",)}),
    "all failed": lambda made: made(AXES, fails=1.0),
    "all censored": lambda made: made(AXES, fails=0.0, censors=1.0),
    "all refused": refused,
    "mixed": lambda made: made(AXES, fails=0.3, censors=0.3),
    "words": lambda made: made({"preset": ("a", "b", "c"), "team": (1, 2), "layer": ("x", "y")}),
    "lists": lambda made: made({"world.floor_friction": ("(0.2, 0.2)", "(0.4, 0.4)"), "autonomy": LEVELS}),
    "five factors": lambda made: made(FIVE, replicates=2),
    "many levels": lambda made: made({"world.layout": tuple(range(40)), "autonomy": LEVELS}, replicates=2),
    "sampled": lambda made: made(SAMPLED, replicates=2, design="lhs:30"),
    "unfinished": unfinished,
}


@pytest.mark.parametrize("shape", SHAPES)
def test_any_shape_of_sweep_has_its_parts(made, shape: str):
    sweep = SHAPES[shape](made)
    parts = made_of(SWEEP_PARTS, sweep)
    assert "cells" in [part.name for part in parts]
    if not len(sweep.runs):
        assert all(part.name in ("cells", "states") for part in parts)
    for part in parts:
        if isinstance(part.content, Chart):
            with paper():
                part.content.draw()


@pytest.mark.parametrize("shape", ["no run", "mixed"])
def test_a_sweep_has_a_page(made, shape: str):
    sweep = SHAPES[shape](made)
    page = sweep_html(sweep, made_of(SWEEP_PARTS, sweep))
    assert "<!doctype html>" in page


def test_the_head_says_how_far_it_is(made):
    assert verdict(empty(made)) == "no run is finished"
    part = unfinished(made)
    assert verdict(part).startswith("not finished: 17 of 108 runs so far")
    assert "teleop-sim sweep --resume runs/s" in sweep_html(part, [])
    known = dict(facts(made(AXES, fails=0.0)))
    assert known["Autonomy level"] == "off, low, full"
    assert known["Runs"] == "108 completed"
    assert verdict(made(AXES, fails=0.0)) == "108 runs, 100% completed"


def test_the_same_sweep_gives_the_same_bytes(made):
    axes = {"latency_s": DELAYS, "autonomy": ("off", "full")}
    one, two = (made_of(SWEEP_PARTS, made(axes)) for _ in range(2))
    for first, second in zip(one, two, strict=True):
        if isinstance(first.content, Chart):
            assert drawn(first.content, "svg") == drawn(second.content, "svg")
        else:
            assert first.content == second.content
