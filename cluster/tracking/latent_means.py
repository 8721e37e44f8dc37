"""The MLflow model of a checkpoint: controllers in, latent paths and predicted badness out.

MLflow keeps this file and the package `svaedc` with the model and runs them where it is loaded, so it imports
nothing of `cluster`.
"""

import warnings
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import ArrayLike

from svaedc.model import checkpoint

PLAN: Final = "plan.pt"
"""What computes plans lies beside the checkpoint of a model that reads them."""


class LatentMeans:
    """The means E[tau|x] and of p(y|psi_bar_x), what the kernels are made of."""

    def __init__(self, path: Path) -> None:
        """Read a checkpoint, or a folder of one and of what computes its plans."""
        self._model, _ = checkpoint.load(checkpoint.checkpoint_path(path))
        if self._model.reads_plans:
            self._model.read_plans(_load_traced(path / PLAN))

    def predict(self, model_input: ArrayLike) -> dict[str, np.ndarray]:
        """Latent means of controllers in the unit cube, [n, D].

        Returns:
            `tau`, latent paths [n, K * tau_dim], and `y`, badness in [0, 1], [n].
        """
        with torch.no_grad():
            tau, y = self._model.latent_means(torch.tensor(np.asarray(model_input, np.float32)))
        return {"tau": tau.numpy(), "y": y.numpy()}


def _load_traced(path: Path) -> torch.jit.ScriptModule:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return torch.jit.load(path)


def _load_pyfunc(data_path: str) -> LatentMeans:
    """What MLflow calls to load a model."""
    return LatentMeans(Path(data_path))
