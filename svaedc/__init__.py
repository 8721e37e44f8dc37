"""SVAE-DC: latent paths of trajectories, learnt in simulation, and Bayesian optimisation on top of them.

This is the front door: `import svaedc` offers everything that a study needs, and loads each part when it is
first used. What needs both rollouts and models lives in the shell, `cluster`; here is only a table of where.
The rooms of this package import neither the shell nor `workers`, and nothing in them uses this table.

    >>> import svaedc
    >>> optimizer = svaedc.Optimizer("quadratic-30d", "random")
    >>> optimizer.ask().shape
    (30,)
"""

from importlib import import_module
from typing import Any, Final

_WHERE: Final = {
    "Dataset": "workers.dataset.folder",
    "Optimizer": "cluster.optimizer",
    "Setup": "workers.setups.setup",
    "SvaeDc": "svaedc.model.svae_dc",
    "collect": "cluster.api",
    "compare": "cluster.api",
    "load_model": "cluster.optimization.models",
    "load_setup": "cluster.api",
    "method_names": "cluster.api",
    "open_dataset": "cluster.api",
    "setup_names": "cluster.api",
    "simulate_candidates": "cluster.api",
    "simulated_robot": "cluster.api",
    "train": "cluster.api",
}

__all__ = ["__version__", *_WHERE]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("svaedc")
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it offers {', '.join(_WHERE)}")
    return getattr(import_module(_WHERE[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, *globals()])
