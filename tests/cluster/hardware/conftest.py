"""Fixtures of the hardware tests."""

import multiprocessing

import pytest


@pytest.fixture(scope="session")
def processes():
    """Real processes that start in milliseconds: forked from a server that has imported everything."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.cluster.hardware.desk", "cluster.hardware.executor"])
    return context


@pytest.fixture(scope="session")
def model(tmp_path_factory):
    """An untrained model of the setup's sizes: what it says is arbitrary, but it says it every time."""
    import torch

    from svaedc.model import checkpoint
    from svaedc.model.config import ModelConfig
    from svaedc.model.svae_dc import SvaeDc
    from workers import setups

    setup = setups.load("franka")
    torch.manual_seed(0)
    config = ModelConfig(
        controller_dim=setup.dimensions, observation_dim=len(setup.observation), time_steps=100
    )
    path = tmp_path_factory.mktemp("model") / "model.pt"
    checkpoint.save(path, SvaeDc(config), {"setup": "franka"})
    return path
