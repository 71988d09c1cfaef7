"""All parts of reports, in the order in which a page shows them. A new one is a file and a line here."""

from __future__ import annotations

from teleop_sim.reports.parts import Part
from teleop_sim.reports.run_ledger import ledger_sheet, messages_sheet
from teleop_sim.reports.run_tables import marks_sheet, states_sheet, times_sheet, verification_sheet
from teleop_sim.reports.run_timeline import LAYERS, TIMELINE
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.run_waterfall import waterfall_chart, waterfall_sheet
from teleop_sim.reports.sweep_cells import cells
from teleop_sim.reports.sweep_curves import completion, probability
from teleop_sim.reports.sweep_view import SweepRuns

RUN_PARTS: tuple[Part[Run], ...] = (
    TIMELINE,
    LAYERS,
    Part("waterfall", "Where the time went", waterfall_chart),
    Part("time", "Where the time went, in figures", waterfall_sheet),
    Part("times", "Beside the ViGIR paper's Table 2", times_sheet),
    Part("crew", "What the crew did", marks_sheet),
    Part("states", "States", states_sheet),
    Part("verification", "What people made of the robot's claims", verification_sheet),
    Part("messages", "Messages by topic", messages_sheet),
    Part("packets", "Packets by topic", ledger_sheet),
)

SWEEP_PARTS: tuple[Part[SweepRuns], ...] = (
    Part("completion", "Completion time", completion),
    Part("probability", "Completed runs", probability),
    Part("cells", "Cells", cells),
)
