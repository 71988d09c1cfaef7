"""All parts of reports, in the order in which a page shows them. A new one is a file and a line here."""

from __future__ import annotations

from teleop_sim.reports.parts import Part
from teleop_sim.reports.run_view import Run

RUN_PARTS: tuple[Part[Run], ...] = ()
