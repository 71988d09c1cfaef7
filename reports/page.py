"""All reports of one log, written beside it."""

from __future__ import annotations

from pathlib import Path

from teleop_sim.core.records import PlantSample
from teleop_sim.log.load import load
from teleop_sim.reports.drc_show import is_drc
from teleop_sim.reports.drc_table import run_markdown
from teleop_sim.reports.ledger import MESSAGES_NOTE, ledger, ledger_csv, ledger_markdown, message_ledger
from teleop_sim.reports.table import csv_text, markdown_text, state_table
from teleop_sim.reports.timeline import draw_timeline
from teleop_sim.reports.timeline_layers import draw_layers, has_layers
from teleop_sim.reports.verification import verification, verification_csv, verification_markdown


def write_report(log_path: Path | str, out_dir: Path | str | None = None) -> list[Path]:
    """Write the timeline (PNG and SVG), the per-state table and the ledgers (CSV and Markdown) of a log.

    Args:
        log_path: of the log; may be cut off or interrupted.
        out_dir: folder for the files, made if it is missing; None: the log's own.

    Returns:
        the files: ``<log>.timeline.png``, ``.timeline.svg``, ``.states.csv``, ``.states.md``, ``.link.csv`` and
        ``.link.md``; ``.messages.csv`` and ``.messages.md`` where messages are logged; ``.verification.csv`` and
        ``.verification.md`` where claims were compared with pictures; ``.layers.png``, ``.layers.svg`` and
        ``.layers.md`` of a door or valve, and where the crew worked at layers of control below a behaviour; of a door
        or valve the layers come first.

    Raises:
        LogDamaged: there is no log at that path.
        OSError: a file cannot be written.

    """
    log = load(log_path)
    rows = state_table([log.records()])
    folder = log.path.parent if out_dir is None else Path(out_dir)
    folder.mkdir(parents=True, exist_ok=True)
    name = log.path.name.removesuffix(".part").removesuffix(".mcap")
    png, svg = (folder / f"{name}.{end}" for end in ("timeline.png", "timeline.svg"))
    draw_timeline(log, png)
    draw_timeline(log, svg)
    packets = ledger(log.records())
    texts = {
        "states.csv": csv_text(rows),
        "states.md": markdown_text(rows),
        "link.csv": ledger_csv(packets),
        "link.md": ledger_markdown(packets),
    }
    if messages := message_ledger(log.records("link/message")):
        texts |= {"messages.csv": ledger_csv(messages), "messages.md": ledger_markdown(messages, MESSAGES_NOTE)}
    if judged := verification(log.records()):
        texts |= {"verification.csv": verification_csv(judged), "verification.md": verification_markdown(judged)}
    kept = [r for r in log.records() if not isinstance(r, PlantSample)]
    layers = [folder / f"{name}.layers.{end}" for end in ("png", "svg")] if has_layers(kept) or is_drc(kept) else []
    for picture in layers:
        draw_layers([kept], picture)
        texts["layers.md"] = run_markdown(kept)
    # What shows most of a run comes first.
    pictures = [*layers, png, svg] if is_drc(kept) else [png, svg, *layers]
    for end, text in texts.items():
        (folder / f"{name}.{end}").write_text(text, encoding="utf-8")
    return [*pictures, *(folder / f"{name}.{end}" for end in texts)]
