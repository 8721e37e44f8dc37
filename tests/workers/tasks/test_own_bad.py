"""G_bad supplied by users: stored as they say, and refused with a reason when it is wrong."""

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.gentle import SHIFT
from workers.environments.tabletop import Tabletop
from workers.gymnasium_environment import SetupEnvironment
from workers.rollout import random_episode
from workers.setups.franka import MODEL
from workers.setups.user_bad import with_bad
from workers.tasks.own_bad import conditions

pytestmark = pytest.mark.usefixtures("gentle")


def test_degrees_are_stored_as_the_function_gives_them_and_y_is_their_mean(franka, environment, episode):
    own, rough = random_episode(franka, environment, 0, 1), episode("rough")
    environment.reset(rough.physics)
    command = franka.controller.start(rough.x, environment, 60)
    x, y, _ = environment.observed([environment.step(command(t)) for t in range(60)]).signals["hand_position"]
    expected = [min(1, abs(b) + abs(np.sin(200 * a))) for a, b in zip(x, y, strict=True)]
    assert rough.bad.dtype == np.float32
    assert rough.bad == pytest.approx(expected, rel=1e-6)
    assert np.ptp(rough.bad) > 0.1
    assert rough.y == pytest.approx(sum(rough.bad.tolist()) / 60, rel=1e-12)
    assert (rough.xi.tobytes(), rough.f, rough.x.tolist()) == (own.xi.tobytes(), own.f, own.x.tolist())


def test_flipping_a_function_flips_the_stored_degrees_and_y(episode):
    rough, flipped = episode("rough"), episode("flipped")
    assert flipped.bad == pytest.approx(1 - rough.bad, abs=1e-7)
    assert flipped.y == pytest.approx(1 - rough.y, abs=1e-7)


def test_shifting_a_function_in_time_shifts_the_stored_degrees_and_y(episode):
    rough, shifted = episode("rough"), episode("shifted")
    assert shifted.bad[:SHIFT].tolist() == [0.0] * SHIFT
    assert np.array_equal(shifted.bad[SHIFT:], rough.bad[:-SHIFT])
    lost = rough.bad[-SHIFT:].sum(dtype=np.float64)
    assert shifted.y == pytest.approx(rough.y - lost / 60, abs=1e-9)


def test_rows_of_booleans_are_stored_as_bits(franka, environment, episode):
    rows = episode("rows")
    environment.reset(rows.physics)
    command = franka.controller.start(rows.x, environment, 60)
    _, y, z = environment.observed([environment.step(command(t)) for t in range(60)]).signals["hand_position"]
    assert rows.bad.tolist() == ((y > 0.2) + 2 * (z > 0.2)).tolist()
    assert rows.y == np.mean((y > 0.2) | (z > 0.2))
    assert with_bad(franka, "gentle:rows").conditions == ("left", "high", "never")


def test_yes_and_no_are_degrees_too(episode):
    answers = episode("yes_or_no")
    assert answers.bad.tolist() == (answers.xi[0] > 0.4).astype(float).tolist()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "all_channels",
            r"one number per step, shape \(60,\), got float32 of shape \(25, 60\); reduce the other",
        ),
        ("not_a_number", r"numbers in \[0, 1\], got nan in step 17; scale them"),
        ("too_large", r"numbers in \[0, 1\], got 1\.5 in step 0; .*np\.clip"),
        ("words", r"one number per step.*got <U3"),
        ("nothing", r"one number per step.*got object of shape \(\)"),
        ("misspelt", r"failed with KeyError: 'hand_positions'.*the signals hand_position, table_contact"),
        ("writes", r"failed with ValueError: .*read-only"),
        ("one_row", r"2 conditions and must return bool of shape \(2, 60\), got bool of shape \(1, 60\)"),
        ("numbers", r"1 conditions and must return bool of shape \(1, 60\), got float32.*or unmark it"),
    ],
)
def test_a_wrong_function_is_refused_with_what_is_expected_and_what_to_do(episode, name, message):
    with pytest.raises(ValueError, match=f"gentle:{name} .*{message}"):
        episode(name)


def test_a_function_has_one_to_seven_conditions():
    with pytest.raises(ValueError, match="1 to 7 conditions, got 8"):
        conditions(*"abcdefgh")
    with pytest.raises(ValueError, match="got 0"):
        conditions()


class Exploding(Tabletop):
    """The Franka's scene, whose numbers stop being numbers."""

    def observed(self, records):
        seen = super().observed(records)
        seen.xi[:, -1] = np.nan
        return seen


def test_an_episode_that_diverges_is_entirely_bad(franka):
    setup = with_bad(replace(franka, build=partial(Exploding, MODEL)), "gentle:rough")
    with setup.open() as environment:
        diverged = random_episode(setup, environment, 0, 0)
    assert diverged.stop == "diverged"
    assert diverged.bad.tolist() == np.ones(60, np.float32).tolist()
    assert diverged.bad.dtype == np.float32
    assert diverged.y == 1.0


def test_steps_that_a_stop_rule_spared_have_the_degree_one(franka, environment, episode):
    calls = itertools.count(1)
    stopping = replace(with_bad(franka, "gentle:rough"), stop=lambda _: "tired" if next(calls) == 20 else "")
    stopped, whole = random_episode(stopping, environment, 0, 1), episode("rough")
    assert stopped.stop == "tired"
    assert np.array_equal(stopped.bad[:19], whole.bad[:19])
    assert stopped.bad[19:].tolist() == [1.0] * 41
    assert stopped.y == pytest.approx((whole.bad[:19].sum(dtype=np.float64) + 41) / 60)
    assert stopped.f == np.float32(franka.objective_limits[0])
    assert stopping.conditions == ("rough",)


def test_gymnasium_reports_the_degree_of_a_step(franka):
    adapter = SetupEnvironment(with_bad(franka, "gentle:first_place"))
    seen, start = adapter.reset(seed=3)
    moved, *_, first = adapter.step(np.zeros(7, np.float32))
    adapter.close()
    assert start["bad"] == seen[7]
    assert first["bad"] == moved[7]
    assert 0.0 < first["bad"] < 1.0
