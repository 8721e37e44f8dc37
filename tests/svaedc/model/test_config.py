"""Sizes are refused where no network can be built from them."""

from dataclasses import replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import nn

from svaedc.model.config import KERNEL, STRIDE, ModelConfig, ScaleBounds, decoded_length, encoded_length


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path_length": 0}, r"path_length must be at least 1"),
        ({"channels": ()}, r"channels must be at least 1"),
        ({"prior_hidden": (3, 0)}, r"prior_hidden must be at least 1 everywhere, got \(3, 0\)"),
        ({"distribution": "cauchy"}, r"distribution must be one of laplace, gaussian, got 'cauchy'"),
        ({"head": "sparse"}, r"head must be one of low-rank, dense"),
        ({"prior": "none"}, r"prior must be one of mlp, deconv"),
        ({"time_steps": 21}, r"got 21; lower the training stride"),
    ],
)
def test_impossible_sizes_are_refused_with_the_value(change, message):
    with pytest.raises(ValueError, match=message):
        replace(ModelConfig(4, 5, 40), **change)


@pytest.mark.parametrize(("floor", "cap"), [(0.0, 1.0), (1.0, 1.0), (1.0, float("inf")), (float("nan"), 1.0)])
def test_empty_scale_bounds_are_refused(floor, cap):
    with pytest.raises(ValueError, match="0 < floor < cap"):
        ScaleBounds(floor, cap)


def test_a_configuration_survives_its_dictionary():
    config = ModelConfig(4, 5, 40, channels=(8, 16), latent_scale=ScaleBounds(0.5, 2.0))
    assert ModelConfig.from_dict(config.to_dict()) == config


def test_a_dictionary_with_an_unknown_name_is_refused():
    with pytest.raises(ValueError, match="colour"):
        ModelConfig.from_dict(ModelConfig(4, 5, 40).to_dict() | {"colour": 1})


@given(st.integers(22, 200), st.integers(1, 3))
def test_predicted_lengths_are_those_of_torchs_convolutions(steps, layers):
    sequence = torch.zeros(1, 1, steps)
    down, up = nn.Conv1d(1, 1, KERNEL, STRIDE), nn.ConvTranspose1d(1, 1, KERNEL, STRIDE)
    shorter, longer = sequence, sequence
    for _ in range(layers):
        shorter, longer = down(shorter), up(longer)
    assert encoded_length(steps, layers) == shorter.shape[-1]
    assert decoded_length(steps, layers) == longer.shape[-1]
