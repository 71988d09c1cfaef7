"""The WPI paper's Table II and the ViGIR paper's Table 2 over all runs of a sweep, beside the papers' own figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from typing import Any, Final

from teleop_sim.reports.drc_table import DrcRow, DrcRun, drc_rows
from teleop_sim.reports.drc_times import COLUMNS, Times
from teleop_sim.reports.drc_times import paper_rows as table2_rows
from teleop_sim.reports.parts import Cell, Column, Sheet
from teleop_sim.reports.run_tables import state_sheet
from teleop_sim.reports.sweep_cells import plain, records
from teleop_sim.reports.sweep_layout import at, held, held_note, shown_levels
from teleop_sim.reports.sweep_view import SweepRuns, bare
from teleop_sim.reports.sweep_view import words as words_of
from teleop_sim.reports.table import NOTE, SHORT_NOTE, PaperRow, TableRow, paper_rows, table_of

MISSING: Final = (
    "This sweep was made by a version that did not keep what this table needs. Sweep again into another directory."
)
MOST_ROWS: Final = 40
"""Cells of the table of times; of more, only those of one setting of the link (a choice of layout)."""


def states(sweep: SweepRuns) -> Sheet | None:
    """Table II over all finished runs; None where none is, or none entered a state."""
    if sweep.states is None:
        return Sheet((Column("state", "state"),), (), note=MISSING)
    rows = table_of(list(sweep.entries.values()))
    if not rows:
        return None
    note = f"Over {_runs(sweep)}, whatever their settings."
    made = state_sheet(rows)
    return replace(made, note=f"{note} {made.note}")


def state_levels(sweep: SweepRuns) -> Sheet | None:
    """Table II by level of the compared factor: time, retries and manual recovery; None where nothing is compared."""
    if not sweep.compared or not sweep.entries:
        return None
    levels = shown_levels(sweep)
    tables = [{row.name: row for row in table_of(_entries(sweep, level))} for level in levels]
    names = [row.name for row in table_of(list(sweep.entries.values()))]
    paper = {row: figures for row, figures in paper_rows().values() if figures}
    theirs = bool(set(names) & set(paper))
    rows = tuple(
        (
            name,
            *(cell for table in tables for cell in _figures(table.get(name))),
            *(_figures(paper.get(name)) if theirs else ()),
        )
        for name in names
    )
    total = ("sum", *(cell for table in tables for cell in _sums(table)), *(_sums(paper) if theirs else ()))
    columns = [Column("state", "state")]
    heads = {str(level): f"{bare(sweep.compared)} {sweep.says(sweep.compared, level)}" for level in levels}
    for name, said in (heads | {"paper": "WPI paper, 10 runs"} if theirs else heads).items():
        columns += [
            Column(f"{name}_time_s", "time [s]", 1, said, "mean of the runs that came there"),
            Column(f"{name}_retries", "retries", 2, said, "a run that came there"),
            Column(f"{name}_manual_pct", "MR [%]", 0, said, "share of these runs that needed manual recovery"),
        ]
    said = NOTE if theirs else SHORT_NOTE
    return Sheet(tuple(columns), rows, total, f"Over {_runs(sweep)}, whatever their other settings. {said}")


def _figures(row: TableRow | PaperRow | None) -> tuple[Cell, ...]:
    return (row.time_s, row.retries / row.runs, row.manual_pct) if row else (None, None, None)


def _sums(table: Mapping[str, TableRow] | Mapping[str, PaperRow]) -> tuple[Cell, ...]:
    return sum(row.time_s for row in table.values()), sum(row.retries / row.runs for row in table.values()), None


def _entries(sweep: SweepRuns, level: Any) -> list[Any]:
    rows = sweep.runs[sweep.runs[sweep.compared] == level]
    keys = zip(rows["cell"].tolist(), rows["replicate"].tolist(), strict=True)
    return [sweep.entries[key] for key in keys if key in sweep.entries]


def _runs(sweep: SweepRuns) -> str:
    known, all_of = len(sweep.entries), int((sweep.runs["outcome"] != "refused").sum())
    return f"all {known} runs" if known == all_of else f"{known} of {all_of} runs, those of which states were kept"


def times(sweep: SweepRuns) -> Sheet | None:
    """Table 2: mean and standard deviation of each cell, then the paper's rows of the task; None for other tasks."""
    if not sweep.task.startswith("drc-"):
        return None
    settings = [name for name in sweep.factors if name in sweep.varying]
    columns = (
        Column("row", ""),
        *(Column(name, words_of(name), group="setting") for name in settings),
        Column("runs", "runs"),
        Column("completed", "completed", help="means are of these"),
        *(
            Column(f"{key}{end}", said, decimals, f"{words} [s]", told)
            for key, words in COLUMNS.items()
            for end, said, decimals, told in (("", "mean", 1, ""), ("_sd", "±", 1, "standard deviation of a run"))
        ),
    )
    if sweep.times is None:
        return Sheet(columns, (), note=MISSING) if len(sweep.runs) else None
    paper = {name: row for name, row in table2_rows().items() if name.startswith(sweep.task)}
    theirs = tuple(
        (
            f"ViGIR paper, {row.name}",
            *[None] * len(settings),
            1,
            1,
            *(cell for mean in astuple(row.times) for cell in (mean, None)),
        )
        for row in paper.values()
    )
    notes = [
        "From when the robot had stopped walking. Columns overlap and leave out what people only look at: they do not "
        "add up. The paper's rows are one run each; empty: its template was laid in a pause of the contest.",
        f"This scenario is its row {paper[sweep.name].name}." if sweep.name in paper else "",
        held_note(sweep, _held(sweep)),
    ]
    return Sheet(columns, (*_ours(sweep, settings), *theirs), note=" ".join(filter(None, notes)))


def _held(sweep: SweepRuns) -> Mapping[str, Any]:
    return held(sweep, (sweep.compared,)) if sweep.cells > MOST_ROWS and sweep.grid else {}


def _ours(sweep: SweepRuns, names: Sequence[str]) -> tuple[tuple[Cell, ...], ...]:
    assert sweep.times is not None
    runs = at(sweep.runs, _held(sweep)).merge(sweep.times, on=["cell", "replicate"])
    found = [
        DrcRun(str(cell), replicate, outcome, "", Times(*of))
        for cell, replicate, outcome, *of in runs[["cell", "replicate", "outcome", *COLUMNS]].itertuples(
            index=False, name=None
        )
    ]
    first = runs.drop_duplicates("cell")
    settings = dict(zip(map(str, first["cell"]), records(first[[*names]]), strict=True))
    return tuple(
        ("here", *(plain(settings[row.scenario][name]) for name in names), row.runs, row.completed,
         *(x for pair in _pairs(row) for x in pair))
        for row in drc_rows(found)
    )  # fmt: skip


def _pairs(row: DrcRow) -> list[tuple[float, float]]:
    return list(zip(astuple(row.mean), astuple(row.sd), strict=True))
