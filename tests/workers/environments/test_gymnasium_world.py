"""An environment of Gymnasium as one of ours: its end, its signals, its commands, what it leaves behind."""

from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import TimeLimit, TransformObservation

from tests.workers.environments.sled import ACTION, OBSERVATION, Sled, pushes, vary_mass
from workers.environments.environment import Channel
from workers.environments.gymnasium_world import GymnasiumWorld, keep, make_anew


def opened(make=Sled, **options) -> GymnasiumWorld:
    given = {"observation": OBSERVATION, "action": ACTION, "control_step": 0.1} | options
    return GymnasiumWorld(make, **given)


def run(world: GymnasiumWorld, physics, commands):
    world.reset(physics)
    return world.observed([world.step(command) for command in commands])


def test_an_episode_is_what_gymnasium_itself_says_step_by_step():
    seen = run(opened(), {}, pushes(0.5, 10))
    bare = Sled()
    bare.action_space.seed(0)
    bare.observation_space.seed(0)
    bare.reset(seed=0)
    steps = [(bare.step(np.array([0.5], np.float32)), bare.state.copy()) for _ in range(10)]
    assert seen.xi.dtype == np.float32
    assert np.array_equal(seen.xi, np.array([state for _, state in steps], dtype=np.float32).T)
    assert seen.signals["reward"].tolist() == [step[1] for step, _ in steps]
    assert not seen.signals["terminated"].any()


def test_after_its_end_an_episode_holds_the_last_record_and_has_no_reward():
    world = opened(info=("effort",))
    seen = run(world, {}, pushes(1.0, 30))
    first = int(np.flatnonzero(seen.signals["terminated"])[0])
    assert abs(seen.xi[0, first]) > 1.0 > abs(seen.xi[0, first - 1])
    assert seen.signals["terminated"].tolist() == [False] * first + [True] * (30 - first)
    assert (seen.xi[:, first:] == seen.xi[:, first : first + 1]).all()
    assert seen.signals["reward"].tolist() == [-1.0] * (first + 1) + [0.0] * (29 - first)
    assert seen.signals["effort"].tolist() == [1.0] * 30
    assert world._world.wear == pytest.approx(0.01 * (first + 1))  # it was not stepped again


def test_an_episode_that_is_truncated_ends_too():
    seen = run(opened(lambda: TimeLimit(Sled(), 4)), {}, pushes(0.1, 6))
    assert seen.signals["truncated"].tolist() == [False] * 3 + [True] * 3
    assert not seen.signals["terminated"].any()
    assert (seen.xi[:, 4:] == seen.xi[:, 3:4]).all()


def test_nothing_of_an_episode_reaches_the_next():
    world = opened(apply=vary_mass)
    alone = run(opened(apply=vary_mass), {"mass": 2.0}, pushes(0.5, 10)).xi
    for physics in ({"mass": 2.0}, {"mass": 0.5}, {"mass": 2.0}):
        xi = run(world, physics, pushes(0.5, 10)).xi
        assert np.array_equal(xi, alone) == (physics["mass"] == 2.0)


def test_a_world_that_is_kept_is_the_same_and_bears_what_it_leaves():
    made = []

    def make():
        made.append(Sled())
        return made[-1]

    world = opened(make, renew=keep)
    first, second = (run(world, {}, pushes(0.5, 10)).xi for _ in range(2))
    assert len(made) == 1
    assert not np.array_equal(first, second)
    anew = opened(make, renew=make_anew)
    first, second = (run(anew, {}, pushes(0.5, 10)).xi for _ in range(2))
    assert np.array_equal(first, second)
    assert len(made) == 4


def test_the_start_is_drawn_by_the_physics_parameter_of_that_name():
    world = opened()
    starts = [
        run(world, physics, pushes(0.0, 1)).xi[0, 0] for physics in ({}, {"start": 0.9}, {"start": 1.0})
    ]
    assert starts[0] == starts[1] != starts[2]
    assert run(world, {"start": 1.7}, pushes(0.0, 1)).xi[0, 0] == starts[2]


def test_commands_beyond_their_bounds_are_clipped():
    world = opened()
    assert np.array_equal(run(world, {}, pushes(5.0, 5)).xi, run(world, {}, pushes(1.0, 5)).xi)


def test_what_is_recorded_does_not_change_when_the_environment_overwrites_its_state():
    world = opened()
    world.reset({})
    record = world.record()
    before = record.row.copy()
    world.step([1.0])
    assert np.array_equal(record.row, before)


def test_a_dict_of_boxes_is_one_row_of_numbers():
    def make():
        parts = spaces.Dict({"where": spaces.Box(-9.0, 9.0, (1,)), "also": spaces.Box(-9.0, 9.0, (2, 1))})
        return TransformObservation(
            Sled(), lambda o: {"where": o[:1].astype("f4"), "also": np.float32([[o[1]], [7.0]])}, parts
        )

    channels = tuple(Channel(name, "1", -10.0, 10.0) for name in ("also1", "also2", "where"))
    seen = run(opened(make, observation=channels), {}, pushes(0.5, 3))
    plain = run(opened(), {}, pushes(0.5, 3))
    assert np.array_equal(seen.xi, np.stack([plain.xi[1], np.full(3, 7.0, "f4"), plain.xi[0]]))


def test_a_number_of_info_that_is_not_told_is_refused_by_its_name():
    world = opened(info=("efort",))
    world.reset({})
    assert np.isnan(world.observed([world.record()]).signals["efort"]).all()
    with pytest.raises(ValueError, match="info of Sled has no 'efort'; it has effort"):
        world.step([0.0])


def test_spaces_that_are_no_boxes_are_refused_with_a_remedy():
    with pytest.raises(ValueError, match=r"action space of CartPole-v1 must be a Box .* got Discrete\(2\)"):
        opened(partial(gymnasium.make, "CartPole-v1"))

    class Talking(Sled):
        def __init__(self):
            super().__init__()
            self.observation_space = spaces.Sequence(spaces.Box(0.0, 1.0, (1,)))

    with pytest.raises(ValueError, match="observation space of Talking must be a Box"):
        opened(Talking)


@pytest.mark.parametrize("which", ["action", "observation"])
def test_too_few_channels_are_refused_by_their_names(which):
    with pytest.raises(ValueError, match=rf"{which} must have a channel for each of the .* of Sled, got 0"):
        opened(**{which: ()})


def test_a_simulation_of_mujoco_that_explodes_is_seen_and_not_set_back_to_its_start(monkeypatch, tmp_path):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log there

    def make():
        return gymnasium.make("Hopper-v5", disable_env_checker=True, terminate_when_unhealthy=False)

    def apply(environment, physics):
        environment.unwrapped.model.actuator_gear[:] = physics["gear"]

    world = opened(
        make,
        observation=[Channel(f"o{number}", "1", -100.0, 100.0) for number in range(11)],
        action=[Channel(f"a{number}", "1", -1.0, 1.0) for number in range(3)],
        apply=apply,
    )
    assert np.isfinite(run(world, {"gear": 200.0}, [[1.0] * 3] * 5).xi).all()
    assert not np.isfinite(run(world, {"gear": 1e12}, [[1.0] * 3] * 5).xi[:, -1]).any()
