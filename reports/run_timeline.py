"""The timeline of a run, and the paper's figure of it: parts of its report."""

from __future__ import annotations

from teleop_sim.reports import run_lanes
from teleop_sim.reports.captions import title
from teleop_sim.reports.drc_show import is_drc
from teleop_sim.reports.lane_data import timeline_data
from teleop_sim.reports.lanes import scores
from teleop_sim.reports.parts import Chart, Part, Timeline
from teleop_sim.reports.run_link_lanes import link
from teleop_sim.reports.run_view import Run
from teleop_sim.reports.timeline import timeline_figure
from teleop_sim.reports.timeline_layers import has_layers, layers_figure

NOTE = (
    "Rows of the machine are its states in the order of first visits. A request lasts until its answer has arrived at "
    "the field site. A packet waits, is sent and travels; packets under way together lie below one another."
)


def timeline(run: Run) -> Timeline:
    """The lanes of a run: events, machine, layers of control, crew, robot, autonomy and both directions of the link."""
    lanes = [
        run_lanes.events(run),
        run_lanes.layers(run),
        run_lanes.machine(run),
        run_lanes.requests(run),
        run_lanes.operators(run),
        run_lanes.robot(run),
        run_lanes.level(run),
        link(run, "up"),
        link(run, "down"),
    ]
    guides = [t_s for t_s, _, passed in scores(run.records) if passed]
    alt = f"Timeline of {title(run.records)}".replace("\n", " ")
    still = Chart(lambda: timeline_figure(run.records), alt)
    return Timeline(timeline_data(max(run.end_s, 1e-3), guides, lanes), still, NOTE)


def layers(run: Run) -> Chart | None:
    """Who was at work at which layer of control, as the ViGIR paper's Fig. 17 draws it."""
    if not (has_layers(run.records) or is_drc(run.records)):
        return None
    return Chart(
        lambda: layers_figure([run.records]),
        "Bars over time: requests, alignment, answers, stepping, body motion, behaviour, template, teleoperation",
        "Rows and colours as in Fig. 17 of the ViGIR paper; what is not shaded is the time of the manipulation.",
    )


TIMELINE = Part("timeline", "Timeline", timeline)
LAYERS = Part("layers", "Layers of control", layers)
