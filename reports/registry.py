"""All parts of reports, in the order in which a page shows them. A new one is a file and a line here."""

from __future__ import annotations

from teleop_sim.reports.parts import Part
from teleop_sim.reports.run_ledger import ledger_sheet, messages_sheet
from teleop_sim.reports.run_link import link_chart, link_sheet
from teleop_sim.reports.run_machine import machine_drawing
from teleop_sim.reports.run_operator import age_chart, age_sheet, operator_sheet, workload_chart
from teleop_sim.reports.run_stills import stills_pictures
from teleop_sim.reports.run_tables import marks_sheet, states_sheet, times_sheet, verification_sheet
from teleop_sim.reports.run_timeline import LAYERS, TIMELINE
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.run_walk import walk_chart
from teleop_sim.reports.run_waterfall import waterfall_chart, waterfall_sheet
from teleop_sim.reports.sweep_causes import causes
from teleop_sim.reports.sweep_cells import cells
from teleop_sim.reports.sweep_curves import completion, probability
from teleop_sim.reports.sweep_effects import effects
from teleop_sim.reports.sweep_maps import decision, heat
from teleop_sim.reports.sweep_states import state_levels, states, times
from teleop_sim.reports.sweep_survival import survival
from teleop_sim.reports.sweep_view import SweepRuns
from teleop_sim.reports.sweep_where import where

RUN_PARTS: tuple[Part[Run], ...] = (
    TIMELINE,
    LAYERS,
    Part("waterfall", "Where the time went", waterfall_chart),
    Part("time", "Where the time went, in figures", waterfall_sheet),
    Part("times", "Beside the ViGIR paper's Table 2", times_sheet),
    Part("crew", "What the crew did", marks_sheet),
    Part("states", "States", states_sheet),
    Part("machine", "The machine and its visits", machine_drawing),
    Part("walk", "Map of the walk", walk_chart),
    Part("stills", "The robot in each state", stills_pictures),
    Part("verification", "What people made of the robot's claims", verification_sheet),
    Part("workload", "Workload", workload_chart),
    Part("roles", "Workload, in figures", operator_sheet),
    Part("age", "Age of what people know", age_chart),
    Part("ages", "Age of what people know, in figures", age_sheet),
    Part("link", "Use of the link", link_chart),
    Part("link-totals", "Use of the link, in figures", link_sheet),
    Part("messages", "Messages by topic", messages_sheet),
    Part("packets", "Packets by topic", ledger_sheet),
)

SWEEP_PARTS: tuple[Part[SweepRuns], ...] = (
    Part("completion", "Completion time", completion),
    Part("decision", "What is best where", decision),
    Part("probability", "Completed runs", probability),
    Part("survival", "Not yet completed over time", survival),
    Part("heat", "Time and completion over two factors", heat),
    Part("where", "Where the time went", where),
    Part("effects", "Which factors matter", effects),
    Part("cells", "Cells", cells),
    Part("causes", "Why runs did not complete", causes),
    Part("times", "Beside the ViGIR paper's Table 2", times),
    Part("states", "States", states),
    Part("state-levels", "States by level", state_levels),
)
