"""Presets by name."""

import pytest

from svaedc.training.presets import PRESETS, Sizes, preset, usual_stride

SIZES = Sizes(controller_dim=48, observation_dim=25, time_steps=100)


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_a_preset_takes_the_dataset_s_sizes(name):
    model, training = preset(name)(SIZES)
    assert (model.controller_dim, model.observation_dim, model.time_steps) == (48, 25, 100)
    assert training.joint.updates > 0
    assert usual_stride(name) == {"paper": 1, "compact": 5}[name]


def test_an_unknown_preset_names_the_nearest():
    with pytest.raises(LookupError, match="did you mean 'compact'"):
        preset("compakt")
    with pytest.raises(LookupError, match="did you mean 'paper'"):
        usual_stride("papper")
