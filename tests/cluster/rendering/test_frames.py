"""Which moments of an episode are shown, and what is written on them."""

from dataclasses import replace

import numpy as np
import pytest


@pytest.fixture(scope="module")
def episode(setup):
    """Six made-up steps are bad in one way, the last step in two."""
    from cluster.rendering.episodes import episode_to_draw

    made = episode_to_draw("random:7", setup, None)
    bad = np.zeros(60, dtype=np.uint8)
    bad[11:17], bad[59] = 1, 0b110
    return replace(made, bad=bad)


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
