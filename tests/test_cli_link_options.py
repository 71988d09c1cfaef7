"""Options of ``teleop-sim run`` that choose the link."""

from pathlib import Path

import pytest

from teleop_sim.channel.delivery import DELIVERIES, Custody
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.channel.presets import PRESETS
from teleop_sim.cli_complete import complete_delivery, complete_preset
from teleop_sim.cli_options import scenario_from
from teleop_sim.core.errors import BadInput
from teleop_sim.scenarios.link_schema import LinkDirection


def chosen(out: Path, **given: str):
    return scenario_from("src-dish", {f"--{name.replace('_', '-')}": text for name, text in given.items()}, out)


def refusals(out: Path, **given: str) -> list[tuple[str, str]]:
    with pytest.raises(BadInput) as refused:
        chosen(out, **given)
    return [(problem.where, problem.what) for problem in refused.value.problems]


def test_a_preset_takes_the_place_of_the_whole_link_and_options_change_it(tmp_path: Path) -> None:
    link = chosen(tmp_path, preset="mars-near").link
    assert (link.preset, link.up, link.down) == ("mars-near", LinkDirection(), LinkDirection())
    link = chosen(tmp_path, uplink="64bps", preset="mars-near", loss="0.1", delivery="custody").link
    assert (link.up.rate_bps, link.up.rate_source) == (64.0, "given: --uplink")
    assert link.up.loss == link.down.loss == Bernoulli(0.1)
    assert link.up.loss_source == "given: --loss"
    assert (link.delivery, link.delivery_source, link.up.delay_s) == (Custody(), "given: --delivery", None)


def test_without_a_preset_the_scenario_s_link_stays(tmp_path: Path) -> None:
    link = chosen(tmp_path, loss="0.1").link
    assert (link.preset, link.up.rate_bps, link.up.header_bytes) == (None, 380.0, 40)


def test_tcp_takes_the_place_of_the_headers_that_a_scenario_counts(tmp_path: Path) -> None:
    told = refusals(tmp_path, delivery="tcp")
    assert [where.rpartition(": ")[2] for where, _ in told] == ["link.up.header_bytes", "link.down.header_bytes"]
    assert refusals(tmp_path, header="x") == [("--header", "'x' is not a whole number")]
    link = chosen(tmp_path, delivery="tcp", header="0").link
    assert (link.up.header_bytes, link.down.header_bytes, link.up.header_source) == (0, 0, "given: --header")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"preset": "mars-nea"}, [("--preset", "unknown name 'mars-nea'")]),
        ({"delivery": "pigeon"}, [("--delivery", "unknown name 'pigeon'")]),
        ({"loss": "x"}, [("--loss", "'x' is not a number")]),
        ({"loss": "1"}, [("--loss", "a loss of 1.0")]),
        ({"loss": "nan"}, [("--loss", "a loss of nan")]),
        (
            {"loss": "2", "preset": "moon", "uplink": "1"},
            [("--uplink", "'1' is not understood"), ("--loss", "a loss of 2.0")],
        ),
    ],
)
def test_what_is_wrong_with_the_link_is_told_by_the_option(tmp_path: Path, given: dict[str, str], told: object) -> None:
    assert refusals(tmp_path, **given) == told


def test_a_preset_that_delivers_nothing_in_the_time_is_refused_by_its_option(tmp_path: Path) -> None:
    """64 bit/s, a tenth of a second: 6.4 bits, and one byte has eight."""
    ((where, what),) = refusals(tmp_path, preset="src-task1-hardest", time_limit="0.1s")
    assert where == "--preset"
    assert what.startswith("src-task1-hardest.up.blackouts: the longest light, 0.1 s, carries 6.4 bits")


def test_completion_knows_every_name() -> None:
    assert complete_preset("") == list(PRESETS)
    assert complete_preset("mars-n") == ["mars-near"]
    assert complete_delivery("") == list(DELIVERIES)
