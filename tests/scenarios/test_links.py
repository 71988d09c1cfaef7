"""A scenario's link: what the channel gets of it, and everything that is refused, with its place."""

import json
import math
import re
from functools import partial
from pathlib import Path

import pytest

from teleop_sim.channel.dark import DARK_MODELS
from teleop_sim.channel.delivery import DELIVERIES, BestEffort, Custody, StopAndWait
from teleop_sim.channel.jitter import JITTERS, UniformJitter
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.loss import LOSS_MODELS, Bernoulli
from teleop_sim.channel.presets import PRESETS
from teleop_sim.core.errors import BadInput
from teleop_sim.core.streams import stream
from teleop_sim.scenarios.files import json_schema, load_scenario, read_scenario, scenario_to_toml
from teleop_sim.scenarios.link_schema import LinkDirection
from teleop_sim.scenarios.links import LinkPlan, link_plan

WAYS = "[link.up]\nrate_bps = 380.0\ndelay_s = 10.0\n{}\n[link.down]\nrate_bps = 380e3\ndelay_s = 10.0\n"


def text(link: str = "", up: str = "", down: str = "") -> str:
    """A scenario with more lines in its link; those of ``up`` begin at line 7."""
    return f'schema = 1\nname = "a"\n[link]\n{link}\n{WAYS.format(up)}{down}'


def plan(given: str, seed: int = 1) -> LinkPlan:
    return link_plan(read_scenario(given, "a.toml"), partial(stream, seed, 0))


def refusals(given: str) -> list[str]:
    with pytest.raises(BadInput) as refused:
        read_scenario(given, "a.toml")
    return [f"{p.where}: {p.what}" for p in refused.value.problems]


def test_a_plain_scenario_has_a_plain_link() -> None:
    """The four settings that the closed form knows, and nothing is repeated."""
    made = link_plan(
        load_scenario("src-dish", {"link.up.blackouts": [[60, 120], [300.0, math.inf]]}), partial(stream, 1, 0)
    )
    assert made.up.settings == DirectionSettings(380.0, 10.0, 40, ((60.0, 120.0), (300.0, math.inf)))
    assert made.up.settings.neutral
    assert made.down.settings.neutral
    assert made.up.delivery == made.down.delivery == BestEffort()
    assert made.round_trip_s == 20.0


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_both_directions_as_it_draws_them(name: str) -> None:
    scenario = read_scenario(f'schema = 1\nname = "a"\n[link]\npreset = "{name}"\nreal_time_factor = 0.16\n', "a.toml")
    made = link_plan(scenario, partial(stream, 5, 2))
    for way, settings in (("up", made.up.settings), ("down", made.down.settings)):
        rng = stream(5, 2, f"link.{way}.dark")
        assert settings == PRESETS[name].settings(scenario.time_limit_s, rng, way, 0.16)
    assert read_scenario(scenario_to_toml(scenario), "again") == scenario


def test_what_a_direction_says_takes_the_preset_s_place() -> None:
    given = '[link]\npreset = "drc-trials-2013"\n[link.up]\ndelay_s = 3.0\nloss = { model = "bernoulli", p = 0.1 }\n'
    made = plan(f'schema = 1\nname = "a"\n{given}')
    preset = PRESETS["drc-trials-2013"].settings(1800.0, stream(1, 0, "x"))
    assert made.up.settings.rates == preset.rates
    assert (made.up.settings.delay_s, made.up.settings.delays) == (3.0, ())
    assert made.up.settings.loss == Bernoulli(0.1)
    assert made.down.settings.delays == preset.delays


def test_a_second_link_of_a_preset_can_be_the_way_back() -> None:
    given = 'schema = 1\nname = "a"\n[link]\npreset = "drc-finals-2015"\n[link.down]\nway = "burst"\n'
    down = plan(given).down.settings
    assert down.rate_bps == 300e6
    assert len(down.blackouts) > 50
    assert refusals(given.replace("burst", "up").replace("drc-finals-2015", "moo"))[0].endswith("unknown name 'moo'")
    assert refusals(given.replace("drc-finals-2015", "moon")) == ["a.toml:6:1: link.down.way: unknown name 'burst'"]


def test_the_wall_s_clock_holds_for_every_time_and_rate() -> None:
    """At a tenth of real time, 10 s on the wall are 1 s, and 380 bit/s are 3800 bits a simulated second."""
    up = """
    jitter = { model = "uniform", low_s = 0.0, high_s = 1.0 }
    delays = [[0.0, 10.0], [100.0, 20.0]]
    blackouts = [[50.0, 60.0]]
    by_state = [{ state = "STATE_END", rate_bps = 1e3 }]
    """
    made = plan(text('clock = "wall"\nreal_time_factor = 0.1', up.replace("\n    ", "\n")))
    settings = made.up.settings
    assert (settings.rate_bps, settings.delay_s) == pytest.approx((3800.0, 1.0))
    assert settings.jitter == UniformJitter(0.0, 0.1)
    assert settings.delays == ((0.0, 1.0), (10.0, 2.0))
    assert settings.blackouts == ((5.0, 6.0),)
    assert made.up.rate_in("STATE_END") == pytest.approx(1e4)
    assert made.up.rate_in("STATE_INIT") == settings.rates[0][1] == pytest.approx(3800.0)
    assert made.round_trip_s == pytest.approx(2.0)


def test_a_drawn_dark_differs_by_seed_and_direction_and_ends_with_the_run() -> None:
    dark = 'dark = { model = "random_gaps", mean_light_s = 20.0, mean_dark_s = 5.0 }'
    ones, others = plan(text(up=dark, down=dark), 1), plan(text(up=dark, down=dark), 2)
    schedules = [ones.up.settings.blackouts, ones.down.settings.blackouts, others.up.settings.blackouts]
    assert len(set(schedules)) == 3
    assert all(1700.0 < schedule[-1][1] <= 1800.0 for schedule in schedules)
    assert plan(text(up=dark), 1).up == ones.up


def test_a_delivery_is_the_link_s_unless_a_direction_has_its_own() -> None:
    made = plan(text('delivery = "custody"', down='delivery = { model = "stop_and_wait", tries = 3 }'))
    assert made.up.delivery == Custody()
    assert made.down.delivery == StopAndWait(tries=3)


def test_every_registered_model_can_be_asked_for_and_is_written_back() -> None:
    for key, models in (("loss", LOSS_MODELS), ("jitter", JITTERS), ("dark", DARK_MODELS), ("delivery", DELIVERIES)):
        for name, made in models.items():
            given = {"model": name, **getattr(made, "example", {})}
            # TCP brings the headers that this scenario counts.
            headers = {f"link.{way}.header_bytes": 0 for way in ("up", "down")}
            scenario = load_scenario("src-dish", {f"link.up.{key}": given, **headers})
            assert type(getattr(scenario.link.up, key)) is made
            assert getattr(scenario.link.up, f"{key}_source") == "given: override"
            assert read_scenario(scenario_to_toml(scenario), "again") == scenario


@pytest.mark.parametrize(
    ("line", "errors"),
    [
        ("loss = 0.2", ["a.toml:8:1: link.up.loss: 0.2 is not a table"]),
        ('loss = "bernouli"', ["a.toml:8:1: link.up.loss: unknown name 'bernouli'"]),
        ('loss = "bernoulli"', ["a.toml:8:1: link.up.loss.p: is missing"]),
        ("loss = { p = 0.2 }", ["a.toml:8:1: link.up.loss.model: is missing"]),
        ("loss = { model = 3 }", ["a.toml:8:10: link.up.loss.model: 3 is not a text"]),
        ('loss = { model = "bernoulli", p = "x" }', ["a.toml:8:31: link.up.loss.p: 'x' is not a number"]),
        (
            'loss = { model = "bernoulli", p = 1.5, q = 1 }',
            ["a.toml:8:31: link.up.loss.p: a loss of 1.5", "a.toml:8:40: link.up.loss.q: unknown key"],
        ),
        (
            'jitter = { model = "empirical", samples_s = [0.1, nan] }',
            ["a.toml:8:51: link.up.jitter.samples_s[1]: a jitter of nan s"],
        ),
        (
            'jitter = { model = "uniform", low_s = -20.0, high_s = 1.0 }',
            ["a.toml:8:1: link.up.jitter: a delay of 10.0 s with -20.0 s of jitter arrives before it goes"],
        ),
        (
            'delivery = { model = "custody", tries = 0.5, window = 0 }',
            [
                "a.toml:8:33: link.up.delivery.tries: 0.5 tries",
                "a.toml:8:46: link.up.delivery.window: 0 messages on their way",
            ],
        ),
        ('dark = { model = "drc_finals", off_s = [1] }', ["a.toml:8:32: link.up.dark.off_s[1]: is missing"]),
        ('on_dark = "wait"', ["a.toml:8:1: link.up.on_dark: 'wait' is not 'pause', 'restart' or 'lose'"]),
        ('discipline = "lifo"', ["a.toml:8:1: link.up.discipline: unknown name 'lifo'"]),
        ("priorities = { mirrer = 1 }", ["a.toml:8:1: link.up.priorities: unknown name 'mirrer'"]),
        ("priorities = { mirror = 1.5 }", ["a.toml:8:16: link.up.priorities.mirror: 1.5 is not a whole number"]),
        ("rates = [[5.0, 64.0]]", ["a.toml:8:10: link.up.rates[0]: the first rate holds from 5.0 s"]),
        ("delays = [[0, 1], [9, -1]]", ["a.toml:8:19: link.up.delays[1]: "]),
        ("mtu_bytes = 20\nheader_bytes = 40", ["a.toml:8:1: link.up.mtu_bytes: fragments of 20 bytes hold no more"]),
        ('way = "burst"', ["a.toml:8:1: link.up.way: 'burst' of no preset"]),
        (
            'blackouts = [[1, 2]]\ndark = { model = "periodic", period_s = 9, dark_s = 1, first_s = 0 }',
            ["a.toml:9:1: link.up.dark: stands beside blackouts"],
        ),
        (
            "rates = [[0.0, 64.0]]\nalternating = [{ for_s = 1, rate_bps = 1, delay_s = 1 }]",
            ["a.toml:9:1: link.up.alternating: stands beside rates"],
        ),
        (
            'by_state = [\n  { state = "STATE_EMD", rate_bps = 1 },\n  { state = "STATE_END", rate = 1 }]',
            [
                "a.toml:10:3: link.up.by_state[1].rate_bps: is missing",
                "a.toml:10:26: link.up.by_state[1].rate: unknown key",
            ],
        ),
        (
            '[[link.up.by_state]]\nstate = "STATE_EMD"\nrate_bps = 1.0\n[[link.up.by_state]]\nstate = "STATE_END"\n'
            'rate_bps = 1.0\n[[link.up.by_state]]\nstate = "STATE_END"\nrate_bps = 2.0',
            [
                "a.toml:9:1: link.up.by_state[0].state: unknown name 'STATE_EMD'",
                "a.toml:15:1: link.up.by_state[2].state: STATE_END was given before",
            ],
        ),
    ],
)
def test_a_wrong_line_is_named_with_line_and_column(line: str, errors: list[str]) -> None:
    found = refusals(text(up=line))
    assert len(found) == len(errors), found
    for one, wanted in zip(found, errors, strict=True):
        assert one.startswith(wanted), found


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("blackouts = [[0, inf]]", "a.toml:8:1: link.up.blackouts: it is dark all the time"),
        ("blackouts = [[0.01, inf]]", "a.toml:8:1: link.up.blackouts: the longest light, 0.01 s, carries 3.8 bits"),
        ("budget_bits = 7", "a.toml:8:1: link.up.budget_bits: a budget of 7 bits is below one header and one byte"),
        (
            'dark = { model = "passes", contacts = [[2000.0, 2100.0]] }',
            "a.toml:8:1: link.up.dark: it is dark all the time",
        ),
    ],
)
def test_a_link_that_never_delivers_is_refused_with_the_reason(line: str, error: str) -> None:
    (found,) = refusals(text(up=line))
    assert found.startswith(error)


@pytest.mark.parametrize("key", ["link", "up", "down"])
def test_a_scenario_that_charges_tcp_s_headers_twice_is_refused(key: str) -> None:
    """Segments of TCP go one way and its acknowledgements the other: both ways have its headers."""
    given = {"link": "", "up": "header_bytes = 40", "down": "header_bytes = 28"}
    given[key] = f'delivery = "tcp"\n{given[key]}'
    (found,) = refusals(text(**given))
    assert "link.up.header_bytes: 40 bytes and TCP's and IP's own 40" in found
    given["up"] = given["up"].replace("40", "39")
    assert plan(text(**given)).up.settings.header_bytes == 39


def test_fragments_too_short_for_tcp_are_refused_before_the_run() -> None:
    (found,) = refusals(text(link='delivery = "tcp"', up="mtu_bytes = 40"))
    assert found.startswith("a.toml:8:1: link.up.mtu_bytes: fragments of 40 bytes hold no TCP segment")


def test_both_directions_are_judged_at_once() -> None:
    dark = "blackouts = [[0, inf]]"
    assert [f.split(":")[1] for f in refusals(text(up=dark, down=dark))] == ["8", "12"]


def test_without_a_preset_each_direction_needs_its_rate_and_delay() -> None:
    assert refusals('schema = 1\nname = "a"\n[link.up]\nloss = "none"\n') == [
        "a.toml:3:2: link.down: is missing",
        "a.toml:3:7: link.up.rate_bps: is missing",
        "a.toml:3:7: link.up.delay_s: is missing",
    ]


def test_a_number_of_the_link_that_has_no_source_says_assumed() -> None:
    scenario = read_scenario(text(up='loss = { model = "bernoulli", p = 0.1 }\nqueue_limit = 3'), "a.toml")
    up = scenario.link.up
    assert (up.loss_source, up.queue_source, up.jitter_source) == ("assumed", "assumed", None)
    assert 'loss_source = "assumed"' in scenario_to_toml(scenario)
    quantities = {name.removesuffix("_source") for name in LinkDirection.model_fields if name.endswith("_source")}
    stems = {name.rpartition("_")[0] or name for name in LinkDirection.model_fields} | set(LinkDirection.model_fields)
    assert quantities <= stems


def test_the_json_schema_offers_every_model_and_no_null() -> None:
    schema = json_schema()
    keys = schema["$defs"]["LinkDirection"]["properties"]
    for key, models in (("loss", LOSS_MODELS), ("jitter", JITTERS), ("dark", DARK_MODELS), ("delivery", DELIVERIES)):
        assert {one["properties"]["model"]["const"] for one in keys[key]["anyOf"][1:]} == set(models)
    assert schema["$defs"]["Link"]["properties"]["preset"]["enum"] == list(PRESETS)
    assert schema["$defs"]["Link"]["then"]["properties"]["up"]["required"] == ["rate_bps", "delay_s"]
    # JSON has no inf, TOML no null.
    assert "null" not in json.dumps(schema, allow_nan=False)


def test_the_example_of_the_page_is_a_scenario() -> None:
    page = (Path(__file__).parents[2] / "docs" / "link.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    scenario = read_scenario(example, "docs/link.md", "example")
    assert "assumed" not in {
        getattr(way, key) for way in (scenario.link.up, scenario.link.down) for key in ("loss_source", "dark_source")
    }
    # One in ten, as the example says: 0.03 / (0.03 + 0.25) of the packets.
    assert link_plan(scenario, partial(stream, 1, 0)).up.settings.loss.mean_loss == pytest.approx(0.1, abs=0.01)
