"""Training on more data than memory: the process may allocate less than the trajectories weigh."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import re, resource, sys
from dataclasses import replace
from pathlib import Path
import numpy as np
import torch
from svaedc.model.config import ModelConfig
from svaedc.data.episodes import Episodes, split
from svaedc.model.svae_dc import initialized_model
from svaedc.training.config import StageSettings, TrainingSettings, Weighting
from svaedc.training.loop import fit

count, observations, steps = 50_000, 10, 400
torch.set_num_threads(1)

def mapped(name, shape):
    return np.lib.format.open_memmap(Path(sys.argv[1]) / name, "w+", np.float32, shape)

shapes = {"x": (4,), "xi": (observations, steps), "bad": (steps,), "y": ()}
arrays = [mapped(name, (count, *shape)) for name, shape in shapes.items()]
arrays[0][:] = np.random.default_rng(0).random((count, 4))
arrays[1][::100] = 0.5  # most of the file is a hole: it weighs nothing on the disk, but does in memory
arrays = [np.load(Path(sys.argv[1]) / name, mmap_mode="r") for name in shapes]
data = int(re.search(r"VmData:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) << 10
resource.setrlimit(resource.RLIMIT_DATA, (data + 500 * 2**20,) * 2)

try:
    np.array(arrays[1])
except MemoryError:
    print("too large for memory")
halves = split(Episodes(*arrays, np.arange(count)), np.arange(9, count, 10))
config = ModelConfig(4, observations, steps, channels=(4,), rank=8, prior_hidden=(8,), badness_hidden=(8,))
model = initialized_model(config, halves[0], ([0.0] * observations, [1.0] * observations), seed=0)
joint = StageSettings(10, "adam", "cosine", 1e-3, 0.0, 0.0, 1.0)
settings = TrainingSettings(joint, joint, Weighting(1.0, 1.0, 0.0), batch_size=64, epoch_updates=10)
print("updates", list(fit(model, *halves, settings))[-1].update)
"""


@pytest.mark.slow
def test_data_larger_than_the_memory_a_process_may_have_trains_both_stages(tmp_path):
    told = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert told.stdout.splitlines() == ["too large for memory", "updates 20"], told.stderr
    assert (tmp_path / "xi").stat().st_size > 700 * 2**20
    assert Path(tmp_path / "xi").stat().st_blocks * 512 < 50 * 2**20
