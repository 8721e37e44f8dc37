"""Small comparisons: their settings, a model without knowledge, and what they leave behind."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import torch

from cluster.config import CompareSettings
from cluster.tracking import open_tracker
from svaedc.bo.loop import Trial
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact

SETTINGS = CompareSettings(slots=2, pool_size=200)


def untrained(folder: Path, setup: str = "franka", seed: int = 0) -> Path:
    """A checkpoint whose predictions mean nothing; enough to test the machine around it."""
    torch.manual_seed(seed)
    model = SvaeDc(compact(Sizes(48, 25, 100)).model)
    folder.mkdir()
    checkpoint.save(folder / "model.pt", model, {"setup": setup})
    return folder


def table(folder: Path) -> list[dict]:
    return pq.read_table(folder / "trials.parquet").drop(["seconds"]).to_pylist()


def mlflow_runs(tracking_settings) -> tuple[list, list]:
    """Parent runs and child runs, the newest first."""
    runs = open_tracker(tracking_settings).client.search_runs(["1"])
    parents = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    return parents, [run for run in runs if "mlflow.parentRunId" in run.data.tags]


def trial(index: int, seconds: float = 0.1) -> Trial:
    return Trial(index, np.zeros(48, dtype=np.float32), 0.5, 0.1, 0.5, True, "ok", seconds, "")
