"""The same controllers in two simulations."""

from dataclasses import replace

import numpy as np
import pytest

from workers.attempts import Attempts
from workers.collection.twins import outcomes, require_comparable, twins
from workers.episode import FAILED


def pairs(one, other, count=6, gap="same"):
    require_comparable(one, other, gap)
    return list(twins(one, other, 3, count, gap, Attempts))


def test_a_simulation_is_its_own_twin(own_robot):
    robot = own_robot()
    for pair in pairs(robot, robot):
        assert pair.one.xi.tobytes() == pair.other.xi.tobytes()
        assert dict(pair.one.physics) == dict(pair.other.physics)


def test_another_simulation_has_the_same_controllers_and_physics(own_robot):
    robot = own_robot()
    heavy = own_robot(("force / self.physics", "0.5 * force / self.physics"), name="heavy_glider")
    found = pairs(robot, heavy)
    assert all(np.array_equal(pair.one.x, pair.other.x) for pair in found)
    assert all(dict(pair.one.physics) == dict(pair.other.physics) for pair in found)
    assert all(pair.one.f != pair.other.f for pair in found)


def test_a_gap_gives_the_second_physics_of_its_own(own_robot):
    robot = own_robot()
    masses = [pair.other.physics["mass"] for pair in pairs(robot, robot, gap="mass=0.9:1.1")]
    assert all(0.9 <= mass <= 1.1 for mass in masses)
    assert len(set(masses)) == len(masses)
    assert masses == [pair.other.physics["mass"] for pair in pairs(robot, robot, gap="mass=0.9:1.1")]


def test_a_share_disturbs_every_parameter_by_it(own_robot):
    robot = own_robot()
    for pair in pairs(robot, robot, gap="0.01"):
        ratios = [pair.other.physics[name] / value for name, value in pair.one.physics.items()]
        assert ratios == pytest.approx([1.01] * len(ratios))


def test_an_episode_that_fails_fails_alone(own_robot):
    robot = own_robot()
    broken = own_robot(("force = command[0]", "force = 1 / max(0, command[0] - 0.9)"), name="broken_glider")
    stops = [(pair.one.stop, pair.other.stop) for pair in pairs(robot, broken)]
    assert {one for one, _ in stops} == {""}
    assert FAILED in {other for _, other in stops}


def test_setups_with_other_controllers_or_physics_are_refused(own_robot):
    robot = own_robot()
    stronger = own_robot(('"N", -1.0, 1.0) for', '"N", -2.0, 2.0) for'), name="strong_glider")
    with pytest.raises(ValueError, match="their parameters differ in force_0"):
        require_comparable(robot, stronger, "same")
    calm = replace(robot, physics=replace(robot.physics, intervals={"mass": (0.5, 2.0)}), gaps={})
    with pytest.raises(ValueError, match="wind is a parameter of one of them only; name a gap of the second"):
        require_comparable(robot, calm, "same")
    require_comparable(robot, calm, "mass=1:2")
    with pytest.raises(LookupError, match=r"wde.*did you mean 'wide'"):
        require_comparable(robot, robot, "wde")


def test_outcomes_are_the_shares_of_bad_steps_by_condition(own_robot):
    robot = own_robot(("> 0.5", "> 0.1"), name="cautious_glider")
    episodes = [pair.one for pair in pairs(robot, robot)]
    found = outcomes(robot, episodes)
    assert found["f"].tolist() == [episode.f for episode in episodes]
    assert found["bad"].keys() == {"too_fast"}
    assert found["bad"]["too_fast"] == pytest.approx(found["y"])  # the only condition
    assert 0.0 < found["y"].mean() < 1.0
