"""`svaedc render`: what is shown, what is written on it, and in which files."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

from tests.cluster.cli.test_main import svaedc

WIDTH, HEIGHT = 64, 48


@pytest.fixture(scope="module")
def setup():
    from workers import setups

    return replace(setups.load("franka"), horizon=60)


@pytest.fixture(scope="module")
def episode(setup):
    """Six made-up steps are bad in one way, the last step in two."""
    from cluster.rendering.episodes import episode_to_draw

    made = episode_to_draw("random:7", setup, None)
    bad = np.zeros(60, dtype=np.uint8)
    bad[11:17], bad[59] = 1, 0b110
    return replace(made, bad=bad)


@pytest.fixture
def stripes():
    """Pictures that differ: a bright column moves to the right over a dark ground."""
    made = np.full((5, HEIGHT, WIDTH, 3), 40, dtype=np.uint8)
    for number, picture in enumerate(made):
        picture[:, 10 * number : 10 * number + 8] = (200, 120, 30)
    return list(made)


def test_a_clip_reaches_the_last_step_and_loses_no_bad_one(setup, episode):
    from cluster.rendering.frames import clip

    moments = clip(setup, episode, 0.05, 10)  # 60 steps of 2 ms in 24 pictures
    assert len(moments) == 24
    assert moments[-1].step == 59
    # Steps 11 to 16 are bad; the pictures around show 11, 14 and 17, the last one step after them.
    assert [moment.step for moment in moments if moment.conditions] == [11, 14, 17, 59]
    assert moments[-1].conditions == ("object_off_table", "hand_outside_workspace")


def test_stills_show_the_first_and_last_step_and_what_holds_just_then(setup, episode):
    from cluster.rendering.frames import stills

    moments = stills(setup, episode, 6)
    assert [moment.step for moment in moments] == [0, 12, 24, 35, 47, 59]
    last = ("object_off_table", "hand_outside_workspace")
    assert [moment.conditions for moment in moments] == [(), ("object_tipped",), (), (), (), last]


def test_a_graded_condition_is_shown_with_its_degree(setup):
    from cluster.rendering.frames import conditions_in

    assert conditions_in(setup, np.array([0.0, 0.25, 0.1], dtype=np.float32)) == ("object_tipped 25%",)
    assert conditions_in(setup, np.zeros(3, dtype=np.float32)) == ()


@pytest.mark.parametrize(("seconds", "speed"), [(1.0, 0.2), (6.0, 1.0), (24.0, 3.0)])
def test_a_clip_whose_speed_nobody_chose_lasts_5_to_8_seconds(setup, seconds, speed):
    from cluster.rendering.frames import usual_speed

    assert usual_speed(replace(setup, horizon=round(seconds / 0.002))) == pytest.approx(speed)


@pytest.mark.parametrize("speed", [0.0, 0.01, -1.0, float("nan"), float("inf")])
def test_a_speed_that_cannot_be_shown_is_refused(setup, episode, speed):
    from cluster.errors import UsageError
    from cluster.rendering.frames import clip

    with pytest.raises(UsageError, match=r"--speed must be at least 0\.02 with --fps 10"):
        clip(setup, episode, speed, 10)


def test_only_a_bad_step_has_a_red_border_and_the_picture_itself_stays():
    from cluster.rendering.frames import RED, caption

    blank = np.full((90, 120, 3), 90, dtype=np.uint8)
    good = caption(blank, "0.10 s", "franka", ())
    bad = caption(blank, "0.10 s", "franka", ("object_tipped",))
    assert (blank == 90).all()
    for edge in (bad[0], bad[-1], bad[:, 0], bad[:, -1]):
        assert (edge == RED).all()
    assert (good[0] == 90).all()
    assert (good != blank).any()
    low = slice(60, 85), slice(5, 115)
    assert (bad[low] != good[low]).any()


def test_a_gif_opens_again_with_every_picture_in_its_place(stripes, tmp_path):
    from cluster.rendering.video import write

    write(tmp_path / "clip.gif", ".gif", iter(stripes), 10)
    with Image.open(tmp_path / "clip.gif") as clip:
        assert (clip.size, clip.n_frames) == ((WIDTH, HEIGHT), 5)
        durations = []
        for number, picture in enumerate(stripes):
            clip.seek(number)
            durations.append(clip.info["duration"])
            difference = np.asarray(clip.convert("RGB")).astype(int) - picture
            assert np.abs(difference).max() <= 2
    assert durations == [100, 100, 100, 100, 1100]


def test_a_png_holds_the_stills_in_rows_without_loss(stripes, tmp_path):
    from cluster.rendering.video import write

    write(tmp_path / "strip.png", ".png", iter(stripes), 10)
    with Image.open(tmp_path / "strip.png") as image:
        strip = np.asarray(image)
    assert strip.shape == (2 * HEIGHT, 3 * WIDTH, 3)
    assert (strip[:HEIGHT, WIDTH : 2 * WIDTH] == stripes[1]).all()
    assert (strip[HEIGHT:, :WIDTH] == stripes[3]).all()
    assert (strip[HEIGHT:, 2 * WIDTH :] == 255).all()


def test_an_mp4_opens_again_with_every_picture_and_its_rate(stripes, tmp_path):
    av = pytest.importorskip("av")
    from cluster.rendering.video import HOLD, write

    write(tmp_path / "clip.mp4", ".mp4", iter(stripes), 10)
    with av.open(str(tmp_path / "clip.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == Fraction(10)
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(decoded) == len(stripes) + HOLD * 10
    for picture, frame in zip(stripes, decoded[: len(stripes)], strict=True):
        assert np.abs(frame.astype(int) - picture).mean() < 6


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
    from cluster.rendering.episodes import episode_to_draw
    from workers.rollout import random_episode

    with setup.open() as environment:
        collected = random_episode(setup, environment, 7, 0)
    shown = episode_to_draw("random:7", setup, 7)
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


def test_the_command_writes_what_it_says(tmp_path):
    sizes = ("--width", str(WIDTH), "--height", str(HEIGHT), "--stills", "2")
    result = svaedc(
        "render", "--setup", "franka", "--x", "random:7", "--out", "new/strip.png", *sizes, folder=tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert "wrote" in result.stderr
    assert "2 pictures" in result.stderr
    with Image.open(tmp_path / "new" / "strip.png") as image:
        assert image.size == (2 * WIDTH, HEIGHT)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["strip.png"]


@pytest.mark.parametrize(
    ("name", "width", "message"),
    [
        ("clip.avi", 64, r"--out must end in \.gif, \.mp4 or \.png, got clip\.avi"),
        ("clip", 64, r"--out must end in \.gif, \.mp4 or \.png, got clip"),
        ("clip.gif", 4, "width must be 16 to 4096 pixels, got 4; change --width"),
        ("clip.mp4", 65, "an .mp4 needs an even width and height, got 65 × 48"),
    ],
)
def test_a_wish_that_cannot_be_met_is_refused_before_anything_is_written(tmp_path, name, width, message):
    from cluster.cli.render import render
    from cluster.errors import UsageError

    if name.endswith("mp4"):
        pytest.importorskip("av")
    with pytest.raises(UsageError, match=message):
        render("franka", "random:7", tmp_path / "new" / name, width=width, height=HEIGHT)
    assert not list(tmp_path.iterdir())
