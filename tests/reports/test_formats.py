"""Contents to files: full precision, escaped, equal bytes in any process."""

import csv
import math
import os
import re
import struct
import subprocess
import sys
from io import StringIO

from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.formats.csv import csv as csv_file
from teleop_sim.reports.formats.files import FORMATS, WRITERS, Made, write_parts
from teleop_sim.reports.formats.latex import latex
from teleop_sim.reports.formats.markdown import markdown, numeric
from teleop_sim.reports.formats.png import png
from teleop_sim.reports.formats.svg import svg
from teleop_sim.reports.page import write_run
from teleop_sim.reports.parts import Chart, Column, Drawing, Picture, Pictures, Sheet, Timeline

NAN = float("nan")
NASTY = '\\a & 50% of #1_{x}^2 ~ $y$ <b>|"q" `c` *d* [e] → µ ±\nnext'
COLUMNS = (
    Column("state", "state"),
    Column("time_s", "time [s]", decimals=1, group="here"),
    Column("n", "#", group="here"),
    Column("paper_s", "time [s]", decimals=1, group="paper, 10 runs"),
)
SHEET = Sheet(
    COLUMNS,
    (("A", 1 / 3, 2, 4.0), (NASTY, NAN, 3, None), ("[B]", 1e-9, 0, 5.0)),
    total=("sum", 1 / 3, 5, 9.0),
    note="100 % of them; a_b.",
)


def chart():
    figure = Figure(figsize=(2, 1))
    figure.subplots().plot([0, 1], [0, 1], label="a")
    return figure


CHART = Chart(chart, "a line")
texts = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=30)


def read(data):
    return list(csv.reader(StringIO(data.decode())))


def test_csv_has_full_numbers_and_nothing_for_the_unknown():
    rows = read(csv_file(SHEET))
    assert rows[0] == ["state", "time_s", "n", "paper_s"]
    assert rows[1] == ["A", repr(1 / 3), "2", "4.0"]
    assert rows[2] == [NASTY, "", "3", ""]
    assert len(rows) == 4  # no sum


@given(st.lists(st.tuples(texts, st.floats(allow_infinity=False), st.integers(), st.none() | st.floats()), max_size=5))
def test_csv_reads_back_as_it_was(rows):
    back = read(csv_file(Sheet(COLUMNS, tuple(rows))))[1:]
    for (text, value, count, _), cells in zip(rows, back, strict=True):
        assert (cells[0], int(cells[2])) == (text, count)
        assert (cells[1] == "" and math.isnan(value)) or float(cells[1]) == value


def test_columns_of_numbers_stand_right():
    assert numeric(SHEET) == [False, True, True, True]
    assert numeric(Sheet((Column("a", "a"),), ())) == [False]


@given(texts, texts)
def test_markdown_keeps_its_columns_whatever_a_text_holds(one, two):
    sheet = Sheet((Column("a", "a"), Column("b", "b")), ((one, two),))
    row = markdown(sheet).decode().split("\n")[2]
    assert len(re.findall(r"(?<!\\)(?:\\\\)*\|", row)) == 3


def test_markdown_is_a_github_table():
    lines = markdown(SHEET).decode().splitlines()
    assert lines[0] == "| state | here time \\[s\\] | here # | paper, 10 runs time \\[s\\] |"
    assert lines[1] == "|---|---:|---:|---:|"
    assert lines[2] == "| A | 0.3 | 2 | 4.0 |"
    assert lines[-3] == "| sum | 0.3 | 5 | 9.0 |"
    assert lines[-1] == "100 % of them; a\\_b."


def balanced(tex):
    """Every environment ends, braces pair, and no special character stands bare."""
    opened = re.findall(r"\\(begin|end)\{(\w+)\}", tex)
    stack = []
    for what, name in opened:
        if what == "begin":
            stack.append(name)
        else:
            assert stack.pop() == name
    assert stack == []
    depth = 0
    for found in re.finditer(r"\\.|[{}]", tex, re.DOTALL):
        depth += {"{": 1, "}": -1}.get(found[0], 0)
        assert depth >= 0
    assert depth == 0
    body = "\n".join(line for line in tex.splitlines() if not line.startswith("%"))
    # Nor does a line break take what follows as its argument.
    return not re.search(r"(?<!\\)[#%~]|\\\\\s*[\[*]", body)


@given(st.lists(st.tuples(texts, st.floats(), st.integers(), st.none()), max_size=4), texts)
def test_latex_is_balanced_and_has_its_cells_whatever_a_text_holds(rows, note):
    tex = latex(Sheet(COLUMNS, tuple(rows), note=note)).decode()
    assert balanced(tex)
    for line in tex.splitlines():
        if line.endswith(r"\\") and "multicolumn" not in line:
            assert len(re.findall(r"(?<!\\)&", line)) == len(COLUMNS) - 1


def test_latex_is_a_booktabs_table_of_its_own():
    tex = latex(SHEET).decode()
    assert balanced(tex)
    for line in (
        "\\begin{tabular}{@{}lrrr@{}}",
        "\\toprule",
        "\\midrule",
        "\\bottomrule",
        "{[}B] & 0.0 & 0 & 5.0 \\\\",
    ):
        assert line in tex.splitlines()
    assert " & \\multicolumn{2}{c}{here} & \\multicolumn{1}{c}{paper, 10 runs} \\\\" in tex.splitlines()
    assert "\\cmidrule(lr){2-3} \\cmidrule(lr){4-4}" in tex
    assert tex.startswith("\\begingroup")
    assert tex.rstrip().endswith("\\endgroup")


def test_each_format_writes_what_it_can_and_passes_over_the_rest(tmp_path):
    picture = Pictures((Picture(b"x", "image/png", "x"),))
    drawing = Drawing(lambda suffix: suffix.encode(), "a drawing")
    made = [
        Made("line", "Line", CHART),
        Made("table", "Table", SHEET),
        Made("time", "Time", Timeline({}, CHART)),
        Made("graph", "Graph", drawing),
        Made("seen", "Seen", picture),
    ]
    files = {f.name: f.read_bytes() for f in write_parts(made, tmp_path, "run", FORMATS)}
    figures = [f"run.{name}.{end}" for name in ("line", "time", "graph") for end in ("png", "svg")]
    assert set(files) == {*figures, "run.table.csv", "run.table.tex", "run.table.md"}
    assert files["run.graph.svg"] == b"svg"
    assert struct.unpack(">II", files["run.line.png"][16:24]) == (260, 130)
    assert files["run.line.svg"] == files["run.time.svg"]
    assert {name for name in FORMATS if name not in WRITERS} == {"html"}


def test_a_user_s_own_settings_do_not_change_a_figure():
    import matplotlib as mpl

    plain = svg(CHART), png(CHART)
    with mpl.rc_context({"lines.linewidth": 7, "font.size": 20, "svg.fonttype": "none"}):
        assert (svg(CHART), png(CHART)) == plain


WRITE = """
import sys
from pathlib import Path
from teleop_sim.reports.page import write_run
write_run(sys.argv[1], sys.argv[2], ("html", "svg", "csv", "latex", "markdown", "png"))
"""


def test_two_processes_write_the_same_bytes(tmp_path, make_run):
    log = tmp_path / "run.mcap"
    with LogWriter(log) as writer:
        for record in make_run(ask=True, blackouts=True):
            writer(record)
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run([sys.executable, "-c", WRITE, log, tmp_path / seed], check=True, env=environment)
    names = sorted(f.name for f in (tmp_path / "1").iterdir())
    assert names == sorted(f.name for f in (tmp_path / "2").iterdir())
    assert {"svg", "csv", "tex", "md", "png", "html"} == {name.rpartition(".")[2] for name in names}
    for name in names:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes(), name


def test_a_run_s_tables_are_balanced(tmp_path, make_run):
    log = tmp_path / "run.mcap"
    with LogWriter(log) as writer:
        for record in make_run(ask=True):
            writer(record)
    tables = write_run(log, None, ("latex",))
    assert len(tables) >= 3
    assert all(balanced(table.read_text()) for table in tables)
