"""Candidates of the Franka, simulated by a cluster, and a model that has learnt nothing yet."""

import numpy as np
import pytest
import torch

from cluster.candidates.plan import plan_candidates
from cluster.candidates.simulate import summarise
from cluster.config import CollectSettings
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc
from workers import setups
from workers.collection.shard import collect_shard

FRANKA = setups.load("franka")
SETTINGS = CollectSettings(episodes_per_shard=8, actors=2)


def untrained_model(folder, seed):
    """Its folder."""
    folder.mkdir(exist_ok=True)
    torch.manual_seed(seed)
    model = SvaeDc(ModelConfig(48, len(FRANKA.observation), FRANKA.horizon // 5))
    checkpoint.save(folder / checkpoint.FILE, model, {"setup": "franka", "stride": 5})
    return folder


@pytest.fixture(scope="session")
def untrained(tmp_path_factory):
    """A model's folder."""
    return untrained_model(tmp_path_factory.mktemp("untrained"), seed=0)


@pytest.fixture(scope="session")
def planned():
    """(folder, **changes) -> the plan of ten candidates, two of them chosen, in two worlds."""
    chosen = np.random.default_rng(9).random((2, 48), dtype=np.float32)

    def plan(folder, **changes):
        asked = {"count": 10, "episodes": 2, "gap": "wide", "seed": 1, "models": [], "chosen": chosen}
        asked |= {"setups": [FRANKA], "settings": SETTINGS}
        return plan_candidates(folder=folder, **{**asked, **changes})

    return plan


@pytest.fixture(scope="session")
def candidates(planned, untrained, tmp_path_factory):
    """Their folder, with latent paths; simulated by this process alone."""
    plan = planned(tmp_path_factory.mktemp("candidates") / "c", models=[untrained])
    roll_out(plan)
    summarise(plan)
    return plan.folder


def roll_out(plan) -> None:
    """Simulate all that is missing."""
    for setup, collection in zip(plan.setups, plan.collections, strict=True):
        for shard in collection.dataset.missing(collection.episodes):
            collect_shard(setup.under("wide"), collection.dataset, shard)
