"""Several processes train one model: against each other, and against one process on the same batches."""

import subprocess
import sys
from pathlib import Path

import pytest
import torch

SCRIPT = """
import sys
from dataclasses import replace
from pathlib import Path
import numpy as np
import torch
from torch.distributed import destroy_process_group, init_process_group
from torch.nn.parallel import DistributedDataParallel
from svaedc.model.config import ModelConfig
from svaedc.data.episodes import Episodes, split
from svaedc.model.svae_dc import initialized_model
from svaedc.data.samplers import WorkerRank
from svaedc.training.config import StageSettings, TrainingSettings, Weighting
from svaedc.training.loop import fit
from svaedc.training.distributed import DistributedContext

folder, rank, world, joint = Path(sys.argv[1]), *map(int, sys.argv[2:])
rng = np.random.default_rng(0)
x = rng.random((200, 6), dtype=np.float32)
xi = np.tanh(x @ rng.standard_normal((6, 3 * 40), dtype=np.float32)).reshape(200, 3, 40)
bad = (xi[:, 0] > 0.3).astype(np.float32)
halves = split(Episodes(x, xi, bad, bad.mean(1), np.arange(200)), np.arange(9, 200, 10))
config = ModelConfig(6, 3, 40, channels=(8, 16), rank=10, prior_hidden=(16,), badness_hidden=(8,))
model = initialized_model(config, halves[0], ([-1.0] * 3, [1.0] * 3), seed=0)
stage = StageSettings(joint, "adam", "cosine", 1e-3, 0.0, 0.0, 1.0)
settings = TrainingSettings(stage, replace(stage, updates=20), Weighting(1.0, 1.0, 0.0), 32, epoch_updates=10)
if world > 1:
    init_process_group("gloo", init_method=f"file://{folder}/meeting", rank=rank, world_size=world)
wrap = DistributedDataParallel if world > 1 else lambda module: module
list(fit(model, *halves, settings, context=DistributedContext(WorkerRank(rank, world), parallelize=wrap)))
torch.save(model.state_dict(), folder / f"{rank}.pt")
if world > 1:
    destroy_process_group()
"""


def trained(folder: Path, world: int, joint: int) -> list[dict[str, torch.Tensor]]:
    """Final weights of every rank."""
    folder.mkdir()
    command = [sys.executable, "-c", SCRIPT, str(folder)]
    ranks = [subprocess.Popen([*command, str(rank), str(world), str(joint)]) for rank in range(world)]
    assert [process.wait(timeout=300) for process in ranks] == [0] * world
    return [torch.load(folder / f"{rank}.pt", weights_only=True) for rank in range(world)]


def test_ranks_end_with_the_same_bits_though_they_see_other_episodes_and_noise(tmp_path):
    one, other = trained(tmp_path / "both", world=2, joint=20)
    assert all(torch.equal(one[name], other[name]) for name in one)


@pytest.mark.slow
def test_two_processes_take_the_steps_of_one(tmp_path):
    """Stage two without dropout draws no noise, so that only the order of additions differs."""
    [alone] = trained(tmp_path / "alone", world=1, joint=0)
    both = trained(tmp_path / "both", world=2, joint=0)[0]
    for name, expected in alone.items():
        torch.testing.assert_close(both[name], expected, rtol=1e-3, atol=1e-5)
