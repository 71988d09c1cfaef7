"""``run --set KEY=VALUE``: any key of a scenario from the command line, as well complained about as in a file."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from teleop_sim.channel.loss import Bernoulli
from teleop_sim.cli_commands import app
from teleop_sim.cli_options import scenario_from
from teleop_sim.core.errors import BadInput
from teleop_sim.scenarios.files import read_scenario, scenario_to_toml
from teleop_sim.scenarios.schema import Scenario


def chosen(out: Path, *settings: str, **given: str) -> Scenario:
    return scenario_from("src-dish", {f"--{name}": text for name, text in given.items()}, out, settings)


def refusals(out: Path, *settings: str, **given: str) -> dict[str, str]:
    with pytest.raises(BadInput) as refused:
        chosen(out, *settings, **given)
    return {p.where: f"{p.what} | {p.hint}" for p in refused.value.problems}


def test_settings_reach_the_scenario_and_say_so(tmp_path: Path) -> None:
    made = chosen(
        tmp_path,
        "link.up.rate_bps=64bps",
        "link.delay_s=250ms",
        "link.loss.p=0.05",
        "world.floor_friction=[0.2,0.2]",
        "world.contact_friction=0.7",
        "disturbances.pushes.force_n=[10, 20]",
        "autonomy=low",
        robot="atlas",
    )
    assert (made.link.up.rate_bps, made.link.up.rate_source) == (64.0, "given: --set link.up.rate_bps")
    assert (made.link.up.delay_s, made.link.down.delay_s) == (0.25, 0.25)
    assert made.link.up.loss == made.link.down.loss == Bernoulli(0.05)
    assert (made.world.floor_friction, made.world.contact_friction) == ((0.2, 0.2), (0.7, 0.7))
    assert made.disturbances.pushes is not None
    assert made.disturbances.pushes.force_n == (10.0, 20.0)
    assert (made.autonomy, made.robot) == ("low", "atlas")
    assert read_scenario(scenario_to_toml(made), "again") == made


def test_nothing_set_changes_nothing(tmp_path: Path) -> None:
    assert chosen(tmp_path) == scenario_from("src-dish", {}, tmp_path)


@pytest.mark.parametrize(
    ("setting", "where", "what"),
    [
        ("link.up.rate_bps=0", "--set link.up.rate_bps", "0 is not above 0"),
        ("link.up.rate_bps=0bps", "--set link.up.rate_bps", "a rate of 0bps delivers nothing"),
        ("link.up.rate_bsp=64bps", "--set link.up.rate_bsp", "unknown key | Did you mean 'rate_bps'?"),
        ("disturbances.pushs.force_n=3", "--set disturbances.pushs.force_n", "unknown key | Did you mean 'pushes'?"),
        ("lnk.up.rate_bps=3", "--set lnk.up.rate_bps", "unknown key | Did you mean 'link'?"),
        ("robot=atlsa", "--set robot", "unknown name 'atlsa' | Did you mean 'atlas'?"),
        ("robot.height=3", "--set robot.height", "robot is 'valkyrie', not a table | Set robot itself."),
        ("world.floor_friction=[0.4, 0.2]", "--set world.floor_friction", "the range runs backwards from 0.4 to 0.2"),
        ("world.floor_friction=[0.4", "--set world.floor_friction", "'[0.4' is no value"),
        ("disturbances.payload.link=left", "--set disturbances.payload.link", "unknown name 'left'"),
        ("disturbances.strength.*Knie*=0.8", "--set disturbances.strength.*Knie*", "unknown name '*Knie*'"),
        ("link.up.delivery.windw=9", "--set link.up.delivery.windw", "unknown key | Did you mean 'window'?"),
        ("seed", "--set", "'seed' sets nothing | Give KEY=VALUE"),
    ],
)
def test_a_bad_setting_is_named_with_what_would_do(tmp_path: Path, setting: str, where: str, what: str) -> None:
    found = refusals(tmp_path, setting)
    assert list(found) == [where]
    assert found[where].startswith(what)


def test_one_key_is_set_once(tmp_path: Path) -> None:
    assert refusals(tmp_path, "seed=1", seed="2") == {
        "--set seed": "was given before, by --seed | Keep one of the two."
    }
    twice = refusals(tmp_path, "link.up.delay_s=1", "link.delay_s=2")
    assert twice == {"--set link.delay_s": "was given before, by --set link.up.delay_s | Keep one of the two."}


def test_all_that_is_wrong_comes_at_once(tmp_path: Path) -> None:
    found = refusals(tmp_path, "nonsense", "link.up.rate_bps=-1", "robot=x", uplink="x")
    assert list(found) == ["--uplink", "--set", "--set robot", "--set link.up.rate_bps"]


def test_the_command_refuses_before_anything_runs(tmp_path: Path) -> None:
    args = ("run", "src-dish", "--set", "sead=3", "--robot", "atlsa", "--out", str(tmp_path / "runs"))
    result = CliRunner().invoke(app, args, prog_name="teleop-sim")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "--set sead: unknown key\n  Did you mean 'seed'?" in result.stderr
    assert "--robot: unknown name 'atlsa'\n  Did you mean 'atlas'?" in result.stderr
    assert not (tmp_path / "runs").exists()
