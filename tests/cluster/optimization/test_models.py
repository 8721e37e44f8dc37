"""Trained models that a user names."""

import pytest
import torch

from cluster.errors import UserError
from cluster.optimization.models import shared_model, trained_model
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc


@pytest.fixture
def folder(tmp_path):
    """An untrained model of the Franka's stand-in, in its folder."""
    torch.manual_seed(0)
    config = ModelConfig(4, 3, 40, channels=(8,), decoder_hidden=(8,), rank=2, prior_hidden=(8,))
    checkpoint.save(tmp_path / "model.pt", SvaeDc(config), {"setup": "franka-rehearsal", "stride": 5})
    return tmp_path


def test_a_folder_and_the_file_in_it_name_the_same_frozen_model(folder):
    x = torch.rand(3, 4)
    found = [trained_model(path, "franka-rehearsal") for path in (folder, folder / "model.pt")]
    assert [each.path for each in found] == [folder / "model.pt"] * 2
    assert found[0].metadata["stride"] == 5
    assert torch.equal(*(each.model.latent_means(x)[0] for each in found))
    assert not found[0].model.training
    assert not any(parameter.requires_grad for parameter in found[0].model.parameters())


def test_a_model_of_another_setup_is_refused_unless_that_is_the_twin(folder):
    with pytest.raises(UserError, match="made for setup 'franka-rehearsal', not 'franka'"):
        trained_model(folder, "franka")
    assert trained_model(folder, "franka", twin="franka-rehearsal").path == folder / "model.pt"
    with pytest.raises(UserError, match="made for setup 'franka-rehearsal', not 'franka'"):
        trained_model(folder, "franka", twin="yumi")


def test_a_model_that_several_runs_share_is_loaded_once(folder):
    first = shared_model(folder / "model.pt", "franka-rehearsal")
    assert shared_model(folder / "model.pt", "franka-rehearsal") is first
