"""`plan` as a verb: what the command prints, and what has no effect is refused."""

import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.hand.planning import Servo
from armimpedance.hand.planning.show import plan, plan_text
from armimpedance.hand.show import write_results
from armimpedance.hand.still import estimate
from manipulandum_sim.hand import simulate_condition


@pytest.fixture(scope="module")
def made():
    return plan(k_percent=5, shape="designed", servo=Servo(20000.0))


def test_the_command_prints_what_the_verb_returns(made, capsys):
    assert main(["plan", "--k-percent", "5", "--shape", "designed", "--servo", "20000"]) == 0
    assert capsys.readouterr().out == plan_text(made, 40) + "\n"


def test_a_plan_tells_of_itself(made, tmp_path):
    frame = made.to_frame()
    assert frame["duration_s"].tolist() == [0.15, 0.2, 0.3]
    assert frame["trials"].min() == made.best.trials
    assert made.to_dict()["obstacle"] == ""
    assert len(repr(made).splitlines()) <= 12
    assert "<table" in made._repr_html_()
    profile = made.write_profile(tmp_path / "p.csv")
    assert profile.shape.name == "designed"
    assert (tmp_path / "p.csv").read_text().startswith("# designed")


def test_progress_counts_to_the_end():
    steps = []
    plan(shape="designed", progress=lambda done, total: steps.append((done, total)))
    assert steps == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.study
def test_a_pilot_may_be_a_record_and_results_a_path(tmp_path):
    recording, _ = simulate_condition(seed=2, sets=3, emg=False)
    of_pilot = plan(pilot=recording, shape="minimum_jerk", duration_s=0.3, max_trials=10**6)
    assert of_pilot.candidates[0].name == "pilot's own"
    write_results(estimate(recording), tmp_path / "hand.csv")
    of_results = plan(results=tmp_path / "hand.csv", shape="designed", noise="sensor")
    assert of_results.setting.arm.name == "repeat_000"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"condition": "x"}, "a condition without a pilot or results"),
        ({"force_by": "limb"}, "without a pilot"),
        ({"pilot": "a", "results": "b"}, "a pilot and results"),
        ({"pilot": "a", "noise": "sensor"}, "brings its own"),
        ({"pilot": "nowhere"}, "nowhere: no such file"),
        ({"shape": "square"}, "shape 'square'"),
    ],
)
def test_what_has_no_effect_or_is_not_there_is_refused(options, says):
    with pytest.raises(InputError, match=says):
        plan(**options)
