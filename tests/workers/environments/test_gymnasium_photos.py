"""Pictures that an environment of Gymnasium draws of states it is put into."""

from ctypes.util import find_library

import numpy as np
import pytest

from tests.workers.environments.sled import Sled
from workers.environments.gymnasium_photos import GymnasiumPhotos


def pose(world, state) -> None:
    world.unwrapped.state[0] = state["position"]


def test_the_picture_shows_the_state_and_not_what_happened_before():
    photos = GymnasiumPhotos(Sled, pose)
    pictures = [photos.picture({"position": x}, 40, 20) for x in (-1.0, 1.0, -1.0)]
    assert pictures[0].shape == (20, 40, 3)
    assert [int(picture[10, :, 0].argmax()) for picture in pictures] == [10, 30, 10]
    photos.close()


def test_any_size_can_be_asked_for_and_pictures_go_on_after_a_close():
    photos = GymnasiumPhotos(Sled, pose)
    for width, height in ((64, 48), (16, 100)):
        assert photos.picture({"position": 0.0}, width, height).shape == (height, width, 3)
        photos.close()
    photos.close()


def test_an_environment_that_draws_nothing_is_refused_with_a_remedy():
    class Blind(Sled):
        def render(self):
            return None

    with pytest.raises(ValueError, match=r"render\(\) of Blind must return uint8 .*sketch\.Sketch instead"):
        GymnasiumPhotos(Blind, pose).picture({"position": 0.0}, 64, 48)


@pytest.mark.skipif(find_library("EGL") is None, reason="MuJoCo draws with EGL where there is no screen")
def test_the_hopper_of_mujoco_is_seen_where_it_stands(monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.setenv("MUJOCO_GL", "egl")
    from functools import partial

    import gymnasium

    def stand(world, state):
        world.unwrapped.set_state(np.array([0.0, state["height"], 0.0, 0.0, 0.0, 0.0]), np.zeros(6))

    photos = GymnasiumPhotos(partial(gymnasium.make, "Hopper-v5", disable_env_checker=True), stand)
    low, high = (photos.picture({"height": height}, 64, 48) for height in (1.25, 1.6))
    photos.close()
    assert low.std() > 5.0
    assert (low != high).any()
