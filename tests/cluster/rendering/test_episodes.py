"""The episode to be drawn, however it is named."""

import numpy as np
import pytest


def test_a_controller_given_in_three_ways_is_the_same(setup, tmp_path):
    from cluster.rendering.episodes import episode_to_draw
    from workers.randomness import Stream, generator

    x = generator(7, Stream.CONTROLLER, 0).random(48, dtype=np.float32)
    np.save(tmp_path / "x.npy", x)
    listed = ",".join(str(number) for number in x)
    episodes = [
        episode_to_draw(wanted, setup, None) for wanted in ("random:7", str(tmp_path / "x.npy"), listed)
    ]
    assert all((episode.x == x).all() for episode in episodes)
    assert len({episode.xi.tobytes() for episode in episodes}) == 1


def test_a_seed_draws_the_physics_of_data_collection(setup):
    from cluster.rendering.episodes import episode_to_draw, first_physics
    from workers.rollout import random_episode

    with setup.open() as environment:
        collected = random_episode(setup, environment, 7, 0)
    shown = episode_to_draw("random:7", setup, first_physics(setup, 7))
    assert shown.physics == collected.physics
    assert shown.xi.tobytes() == collected.xi.tobytes()
    assert episode_to_draw("random:7", setup, None).physics["object1_mass"] == pytest.approx(2.0)


def test_an_episode_of_a_dataset_comes_as_it_was_recorded(small_dataset):
    from cluster.rendering.episodes import episode_to_draw
    from workers import setups
    from workers.rollout import random_episode

    franka = setups.load("franka")
    with franka.open() as environment:
        collected = random_episode(franka, environment, 0, 11)
    shown = episode_to_draw(f"dataset:{small_dataset}:11", franka, None)
    assert shown.xi.tobytes() == collected.xi.tobytes()
    assert shown.bad.tobytes() == collected.bad.tobytes()
    assert shown.physics == collected.physics
    assert (shown.f, shown.stop) == (collected.f, collected.stop)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ("random:x", "SEED must be a whole number from 0, got 'x'; use random:SEED"),
        ("random", "SEED must be a whole number from 0, got ''"),
        ("0.1,0.2", r"x must have shape \(48,\), got \(2,\); franka takes 48 numbers in \[0, 1\]"),
        (",".join(["2"] * 48), r"x must lie in \[0, 1\]; x\[0\] is 2\.0"),
        ("nowhere.npy", "No such file.*--x may be random:SEED"),
        ("frnaka", "could not convert string to float: 'frnaka'; franka takes 48"),
        ("dataset:data", "names no episode; write dataset:FOLDER:INDEX"),
        ("dataset:nowhere:1", "nowhere holds no dataset"),
    ],
)
def test_a_controller_that_does_not_exist_is_refused_with_a_remedy(setup, wanted, message):
    from cluster.errors import UserError
    from cluster.rendering.episodes import episode_to_draw

    with pytest.raises(UserError, match=message):
        episode_to_draw(wanted, setup, None)


def test_an_episode_that_a_dataset_does_not_hold_is_refused(small_dataset):
    from cluster.errors import UsageError
    from cluster.rendering.episodes import episode_to_draw
    from workers import setups

    with pytest.raises(UsageError, match="holds no episode 16; its files hold 0 to 7, 8 to 15"):
        episode_to_draw(f"dataset:{small_dataset}:16", setups.load("franka"), None)
    with pytest.raises(UsageError, match="is of franka, not of daisy-11d; use --setup franka"):
        episode_to_draw(f"dataset:{small_dataset}:0", setups.load("daisy-11d"), None)


def test_physics_are_drawn_or_given_to_the_last_bit_and_not_both():
    from cluster.errors import UsageError
    from cluster.rendering.episodes import first_physics, physics_of
    from workers import setups

    franka = setups.load("franka")
    drawn = first_physics(franka, 3)
    assert physics_of(franka, 3, "") == drawn
    assert physics_of(franka, None, "") is None
    assert physics_of(franka, None, ",".join(f"{name}={value!r}" for name, value in drawn.items())) == drawn
    given = physics_of(franka, None, "object1_mass=1.5")
    assert given == franka.physics.middle() | {"object1_mass": 1.5}
    with pytest.raises(UsageError, match="--physics says what the physics is, and --seed draws it"):
        physics_of(franka, 3, "object1_mass=1.5")
    with pytest.raises(
        UsageError, match="unknown physics parameter 'object1_mas'; did you mean 'object1_mass'"
    ):
        physics_of(franka, None, "object1_mas=1.5")
    with pytest.raises(UsageError, match="must be written NAME=LOW:HIGH or NAME=VALUE, got 'object1_mass='"):
        physics_of(franka, None, "object1_mass")


def test_an_episode_whose_code_raises_is_told_with_its_line(tmp_path, monkeypatch, capsys):
    from cluster.errors import UserError
    from cluster.rendering.episodes import episode_to_draw
    from tests.own_robot import write_robot
    from workers import setups

    monkeypatch.syspath_prepend(tmp_path)
    write_robot(tmp_path, "raising", ("force = command[0]", 'force = {}["puck"]'))
    with pytest.raises(
        UserError, match=r"the episode of raising failed: KeyError: 'puck', at .*raising.py:\d+"
    ):
        episode_to_draw("random:7", setups.load("raising"), None)
    assert "Traceback" in capsys.readouterr().err
