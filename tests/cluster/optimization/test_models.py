"""Trained models that a user names."""

from dataclasses import replace

import pytest
import torch

from cluster.errors import UserError
from cluster.optimization.models import shared_model, trained_model
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc
from workers import setups


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


@pytest.mark.parametrize("setup", ["franka-rehearsal", "franka", "franka-mujoco"])
def test_a_model_serves_every_setup_with_the_same_controllers_and_channels(folder, setup):
    if setup.endswith("mujoco"):
        pytest.importorskip("mujoco")
    assert trained_model(folder, setup).metadata["setup"] == "franka-rehearsal"


def test_a_model_of_other_channels_is_refused_with_what_differs_unless_that_is_the_twin(folder):
    with pytest.raises(
        UserError,
        match=r"made for setup 'franka-rehearsal', not 'yumi', which differs in param.*; and 107 more; name",
    ):
        trained_model(folder, "yumi")
    assert trained_model(folder, "yumi", twin="franka-rehearsal").path == folder / "model.pt"


def test_a_model_of_a_setup_that_is_gone_serves_no_other(folder):
    _, metadata = checkpoint.load(folder / "model.pt")
    model = trained_model(folder, "franka").model
    checkpoint.save(folder / "model.pt", model, {**metadata, "setup": "long_gone"})
    with pytest.raises(UserError, match=r"made for setup 'long_gone', not 'franka'.*long_gone"):
        trained_model(folder, "franka")
    assert trained_model(folder, "long_gone").metadata["setup"] == "long_gone"


def test_a_model_that_several_runs_share_is_loaded_once(folder):
    first = shared_model(folder / "model.pt", "franka-rehearsal")
    assert shared_model(folder / "model.pt", "franka-rehearsal") is first


def plan_reader(folder, channels, setup="franka"):
    config = ModelConfig(48, 3, 40, channels=(8,), decoder_hidden=(8,), rank=2, prior_hidden=(8,))
    model = SvaeDc(replace(config, prior="plan", prior_hidden=(8, 8, 8), plan_channels=channels))
    checkpoint.save(folder / "model.pt", model, {"setup": setup, "stride": 5})


def test_a_model_that_reads_plans_has_those_of_the_robot_it_was_trained_on(tmp_path):
    plan_reader(tmp_path, len(setups.load("franka").controller.planned))
    x = torch.rand(3, 48)
    found = trained_model(tmp_path, "franka-rehearsal").model
    assert torch.equal(found.known_plan_of()(x), setups.load("franka").plans(x, 50))
    assert found.latent_means(x)[0].shape == (3, 9)


@pytest.mark.parametrize(
    ("channels", "setup", "named"),
    [
        (5, "franka", "reads plans of 5 channels, those of franka have 13"),
        (13, "frank", "plans of 'frank'"),
    ],
)
def test_a_model_whose_plans_cannot_be_had_is_refused(tmp_path, channels, setup, named):
    plan_reader(tmp_path, channels, setup)
    with pytest.raises(UserError, match=named):
        trained_model(tmp_path, setup)
