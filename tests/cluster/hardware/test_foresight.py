"""What a person sees of a trial before they let it onto the robot."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from cluster.cli.hardware.campaigns import motion_lines
from cluster.hardware import operator
from cluster.hardware.executor import Executor
from cluster.hardware.record import export
from cluster.hardware.record.foresight import Foresight
from cluster.hardware.states import Approval, State
from tests.cluster.hardware.rehearsals import carried_out, plan_in
from workers import setups
from workers.hardware.preview import simulations, summary
from workers.rollout import rollout

SEED = 3


@pytest.fixture(scope="module")
def waiting(tmp_path_factory):
    """The folder of a campaign whose first trial waits for a person."""
    folder = tmp_path_factory.mktemp("campaign")
    plan = plan_in(folder, trials=0, approval=Approval.OPERATOR)
    carried_out(replace(plan, foresight=Foresight(3, "gif")))
    return folder


def test_a_trial_that_waits_is_simulated_and_drawn_in_the_units_of_the_robot(waiting):
    now = operator.status(waiting)
    setup, trial = setups.load("franka"), now.trials[0]
    assert (now.motion["simulated"]["simulations"], now.motion["simulated"]["failed"]) == (3, 0)
    values = [each["value"] for each in now.motion["x"]]
    np.testing.assert_allclose(values, setup.controller.values(trial.x.astype(np.float32)))
    said = "\n".join(motion_lines(now.motion))
    for words in (
        "simulated 3 times",
        "badness",
        "fastest change of what is seen",
        "keep away from",
        "rad/s",
        "its controller:",
    ):
        assert words in said
    with Image.open(now.motion["clip"]) as clip:
        assert (clip.format, clip.size) == ("GIF", (320, 240))
        assert clip.n_frames > 20


def test_the_simulations_are_rollouts_under_physics_of_data_collection(waiting):
    setup, x = setups.load("franka"), operator.status(waiting).trials[0].x.astype(np.float32)
    shown = operator.status(waiting).motion["simulated"]
    found = list(simulations(setup, x, SEED, 3))
    assert shown == summary(setup, found, 3)
    with setup.open() as environment:
        for each in found:
            again = rollout(setup, environment, x, each.episode.physics)
            assert (again.f, again.y) == (each.episode.f, each.episode.y)
    assert len({each.episode.physics.values() for each in found}) == 3
    assert shown["y"]["mean"] == pytest.approx(np.mean([each.episode.y for each in found]))
    assert shown["clearance"] == min(each.clearance for each in found)


def test_the_clearance_is_negative_exactly_where_the_hand_left_its_workspace():
    setup = setups.load("yumi-mujoco")
    bit = 1 << setup.conditions.index("hand_outside_workspace")
    rng = np.random.default_rng(0)
    seen = set()
    for _ in range(12):
        [found] = simulations(setup, rng.random(setup.dimensions, dtype=np.float32), 0, 1)
        outside = bool((found.episode.bad & bit).any())
        assert (found.clearance < 0) == outside
        seen.add(outside)
    assert seen == {True, False}


def test_where_nobody_approves_nothing_is_simulated(tmp_path):
    plan = replace(plan_in(tmp_path, trials=0), foresight=Foresight(3, "gif"))
    carried_out(plan)
    bodies = [json.loads(json.loads(line)["body"]) for line in list(export.lines(tmp_path))[1:]]
    assert not any("simulated" in body for body in bodies)
    assert not (tmp_path / "previews").exists()


def test_a_robot_that_cannot_be_drawn_still_waits_for_its_person(tmp_path):
    plan = plan_in(tmp_path, trials=0, approval=Approval.OPERATOR)
    (tmp_path / "previews").write_text("in the way")
    executor = Executor(replace(plan, foresight=Foresight(1, "gif")))
    try:
        executor.advance()
    finally:
        executor.close()
    now = operator.status(tmp_path)
    assert now.trials[0].state is State.CHECKED
    assert any(line.startswith("not drawn: ") for line in motion_lines(now.motion))
