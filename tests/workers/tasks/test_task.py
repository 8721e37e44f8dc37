"""A task of a user's own that does not keep its promises is refused before anything is stored."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from workers import setups
from workers.collection.shard import require_working
from workers.episode import Episode
from workers.rollout import random_episode
from workers.tasks.task import Task

HORIZON = 5


@dataclass(frozen=True)
class Own(Task):
    """Says what it is told to say of every episode."""

    conditions: tuple[str, ...]
    rows: Callable[[int], Any]
    f: Any = 1.0
    graded: bool = False

    def is_bad(self, observed) -> Any:
        return self.rows(observed.xi.shape[1])

    def objective(self, observed, bad) -> Any:  # noqa: ARG002
        return self.f


def names(count: int) -> tuple[str, ...]:
    return tuple(f"condition_{number}" for number in range(count))


def quiet(count: int) -> Own:
    return Own(names(count), lambda steps: np.zeros((count, steps), bool))


def own(task: Task, **changes) -> setups.Setup:
    """A point in 30 dimensions with that task."""
    return replace(setups.load("quadratic-30d"), name="own", task=task, horizon=HORIZON, **changes)


def episode(task: Task, **changes) -> Episode:
    setup = own(task, **changes)
    with setup.open() as environment:
        return random_episode(setup, environment, seed=0, index=0)


@pytest.mark.parametrize("count", [1, 7, 8])
def test_every_condition_has_a_bit_of_its_own(count):
    task = Own(names(count), lambda steps: np.eye(count, steps, dtype=bool))
    found = episode(replace(task, rows=lambda steps: np.tile(np.arange(count)[:, None] == count - 1, steps)))
    assert found.bad.tolist() == [2 ** (count - 1)] * HORIZON
    assert found.y == 1.0


@pytest.mark.parametrize(
    ("count", "changes", "message"),
    [
        (9, {}, "own must have 1 to 8 bad conditions, .* got 9: condition_0, .*; join some"),
        (8, {"stop": lambda _: ""}, "got 9: condition_0, .*, stopped; join some"),
        (0, {}, "must have 1 to 8 bad conditions, .* got 0"),
    ],
)
def test_more_conditions_than_a_step_has_bits_are_refused_with_the_setup(count, changes, message):
    with pytest.raises(ValueError, match=message):
        own(quiet(count), **changes)


@pytest.mark.parametrize("conditions", [("slip", "slip"), ("slip", "stopped")])
def test_conditions_that_cannot_be_told_apart_are_refused_with_the_setup(conditions):
    with pytest.raises(ValueError, match=f"own must differ, .* got {', '.join(conditions)}; rename one"):
        own(Own(conditions, lambda steps: np.zeros((2, steps), bool)))


def test_a_graded_task_has_one_name():
    with pytest.raises(ValueError, match=r"one name in `conditions`, .* got 2: condition_0, condition_1"):
        own(Own(names(2), lambda steps: np.zeros((1, steps), np.float32), graded=True))


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (
            Own(names(2), lambda steps: np.zeros((3, steps), bool)),
            r"Own\.is_bad must return bool of shape \(2, 5\), one row for each of condition_0, condition_1 "
            r"and one column per step, got bool of shape \(3, 5\); make its rows and `conditions` agree",
        ),
        (Own(names(2), lambda steps: np.zeros((1, steps), bool)), r"\(2, 5\), .* of shape \(1, 5\)"),
        (Own(names(1), lambda steps: np.zeros(steps, bool)), r"\(1, 5\), .* got bool of shape \(5,\)"),
        (Own(names(1), lambda steps: np.zeros((1, steps - 1), bool)), r"got bool of shape \(1, 4\)"),
        (Own(names(1), lambda steps: np.zeros((1, steps), np.float32)), r"must return bool .* got float32"),
        (
            Own(names(1), lambda steps: np.zeros((2, steps), np.float32), graded=True),
            r"must return float32 of shape \(1, 5\), .* got float32 of shape \(2, 5\)",
        ),
        (
            Own(names(1), lambda steps: np.full((1, steps), np.nan, np.float32), graded=True),
            r"degrees in \[0, 1\], got nan in step 0; scale them, or clip",
        ),
        (
            replace(quiet(1), f=float("nan")),
            "the objective of Own must be a finite number, got nan; return one for every episode",
        ),
        (replace(quiet(1), f=float("-inf")), "must be a finite number, got -inf"),
        (replace(quiet(1), f=None), "must be a finite number, got nan"),
    ],
)
def test_what_no_episode_can_hold_is_refused_by_the_try_out(task, message):
    with pytest.raises(ValueError, match=message):
        require_working(own(task), seed=0)


def test_degrees_in_double_precision_are_stored_as_float32():
    task = Own(names(1), lambda steps: np.linspace(0.0, 1.0, steps)[None], graded=True)
    assert episode(task).bad.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert episode(task).bad.dtype == np.float32


def test_the_objective_of_a_stopped_episode_is_held_to_the_same():
    found = episode(replace(quiet(1), f=float("nan")), stop=lambda _: "at once")
    assert (found.stop, found.f, found.y) == ("diverged", np.float32(30.0), 1.0)
