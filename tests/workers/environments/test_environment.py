"""What `observed` of a user's environment returns, held to its shape by the names of the channels."""

import re

import pytest

from workers.episode import DIVERGED
from workers.rollout import draw, random_episode, rollout

RETURNS = "return Observed(np.array(records, dtype=np.float32).T, {})"


@pytest.mark.parametrize(
    ("instead", "message"),
    [
        (
            "return Observed(np.array(records, dtype=np.float32), {})",
            "observed() of own_glider gave ξ [20, 2], the setup has 2 channels (position, speed) and 20 "
            "steps: transpose it",
        ),
        (
            "return Observed(np.array(records, dtype=np.float32).T[:1], {})",
            "gave ξ [1, 20], the setup has 2 channels (position, speed) and 20 steps: give one row "
            "per channel",
        ),
        ("return Observed(np.zeros((2, 7), np.float32), {})", "gave ξ [2, 7], the setup has 2 channels"),
        ("return np.array(records).T", "must return Observed(xi, signals) with an array xi, got ndarray"),
        ("return None", "must return Observed(xi, signals) with an array xi, got NoneType"),
        (
            RETURNS.replace("{}", "{'touch': np.zeros(3)}"),
            "gave the signal 'touch' with shape [3]; its last axis must be the 20 steps",
        ),
    ],
)
def test_another_type_or_shape_is_refused_by_name(own_robot, instead, message):
    setup = own_robot((RETURNS, instead))
    with setup.open() as environment, pytest.raises(ValueError, match=re.escape(message)):
        rollout(setup, environment, *draw(setup, 0, 0))


@pytest.mark.parametrize("value", ["np.inf", "-np.inf", "np.nan", "1e30", "5.1"])
def test_whatever_is_not_finite_or_leaves_its_bounds_is_a_diverged_episode(own_robot, value):
    setup = own_robot(("return (self.position, self.speed)", f"return (self.position, {value})"))
    with setup.open() as environment:
        assert random_episode(setup, environment, 0, 0).stop == DIVERGED


@pytest.mark.parametrize("value", ["np.inf", "np.nan", "None"])
def test_an_objective_that_is_not_finite_is_a_diverged_episode_and_keeps_its_trajectory(own_robot, value):
    sound, setup = (
        own_robot(),
        own_robot(("return float(observed.xi[0, -1])", f"return {value}"), name="odd_glider"),
    )
    with sound.open() as one, setup.open() as other:
        expected, found = random_episode(sound, one, 0, 0), random_episode(setup, other, 0, 0)
    assert (found.stop, found.f, found.y) == (DIVERGED, -2.0, 1.0)
    assert found.xi.tobytes() == expected.xi.tobytes()
