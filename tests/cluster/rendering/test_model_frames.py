"""Original, reconstruction and generation side by side: which sample stands where, and what is written."""

import numpy as np
import pytest
from PIL import Image

from workers.collection.shard import collect_shard

SIDE = (64, 48)


@pytest.fixture(scope="module")
def setup():
    from workers import setups

    return setups.load("franka")


@pytest.fixture(scope="module")
def episode(small_dataset):
    from workers.dataset.folder import open_dataset

    return open_dataset(small_dataset).episode(3)


def shown(episode, stride: int):
    """A telling whose model repeats the episode exactly."""
    from cluster.rendering.model_frames import ModelView
    from svaedc.model.reconstruction import Reconstruction
    from workers.episode import stride_steps

    xi = episode.xi[:, stride_steps(500, stride)]
    told = (Reconstruction("reconstructed", xi, 0.25), Reconstruction("generated", xi, float("nan")))
    return ModelView("title", episode, told, stride)


def parts(strip):
    return [strip[:, number * SIDE[0] : (number + 1) * SIDE[0]] for number in range(3)]


@pytest.mark.parametrize("stride", [1, 5])
def test_a_model_that_repeats_the_trajectory_is_drawn_like_it(setup, episode, stride):
    from cluster.rendering.frames import Moment
    from cluster.rendering.model_frames import strips
    from workers.pictures import Size

    moments = [Moment(step, ()) for step in (4, 249, 499)]
    drawn = [parts(strip) for strip in strips(setup, shown(episode, stride), moments, Size(*SIDE))]
    below = slice(20, None)  # captions differ
    for original, reconstructed, generated in drawn:
        assert (original[below] == reconstructed[below]).all()
        assert (original[below] == generated[below]).all()
    assert (drawn[0][0][below] != drawn[2][0][below]).any()


def test_every_picture_says_how_bad_it_is_where_the_model_knows():
    from cluster.rendering.model_frames import badness_note

    assert badness_note(0.254) == "bad 25%"
    assert badness_note(float("nan")) == ""


def test_blocks_stand_in_rows_of_two_below_their_titles():
    from cluster.rendering.frames import TITLE
    from cluster.rendering.model_frames import GAP, board

    strip = np.full((10, 30, 3), 70, dtype=np.uint8)
    whole = board(["a", "b", "c"], [[strip, strip]] * 3)
    assert whole.shape == (2 * (TITLE + 20), 2 * (30 + GAP), 3)
    assert (whole[TITLE : TITLE + 20, :30] == 70).all()
    assert (whole[TITLE + 20 + TITLE :, :30] == 70).all()
    assert (whole[-20:, 30 + GAP :] == 255).all()


def test_an_episode_of_other_sizes_than_the_models_is_refused(episode):
    from cluster.rendering.model_frames import model_view
    from svaedc.model.config import ModelConfig
    from svaedc.model.svae_dc import SvaeDc

    model = SvaeDc(ModelConfig(48, 25, 50)).eval()
    with pytest.raises(ValueError, match=r"\(48, 25, 50\), this episode has \(48, 25, 100\)"):
        model_view("title", episode, model, 5)
    assert model_view("title", episode, model, 10).told[1].xi.shape == (25, 50)


def test_a_setup_with_nothing_to_see_leaves_no_file_and_says_so(tmp_path, capsys):
    from cluster.rendering.model_frames import write_remarkable
    from svaedc.model.config import ModelConfig
    from svaedc.model.svae_dc import SvaeDc
    from workers import setups
    from workers.dataset.cache import training_cache
    from workers.dataset.folder import create
    from workers.dataset.identity import identity_of

    quadratic = setups.load("quadratic-30d")
    dataset = create(tmp_path / "data", identity_of(quadratic, seed=0, episodes_per_shard=32))
    for shard in dataset.missing(64):
        collect_shard(quadratic, dataset, shard)
    cache = training_cache(dataset, 1, tmp_path / "cache")
    model = SvaeDc(ModelConfig(30, 30, 100)).eval()
    assert write_remarkable(tmp_path, model, dataset, cache, 1, 3) == []
    assert "quadratic-30d has nothing to see" in capsys.readouterr().err
    assert not list(tmp_path.glob("motions*"))


def test_a_clip_and_its_stills_come_from_the_same_moments(setup, episode, tmp_path):
    from cluster.rendering.model_frames import write_model_frames

    made = write_model_frames(tmp_path, [shown(episode, 5)], setup, 2)
    assert [path.name for path in made] == ["motions.png", "motions.gif"]
    with Image.open(made[1]) as clip, Image.open(made[0]) as stills:
        assert clip.n_frames == 2
        assert stills.width == clip.width
        assert stills.height == clip.height + 120
