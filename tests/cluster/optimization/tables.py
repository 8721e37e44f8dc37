"""Tables of candidates whose numbers mean nothing."""

import numpy as np

from cluster.optimization.candidates import CandidateTable, parameters_of
from workers import setups
from workers.rollout import VERSION

FRANKA, RNG = setups.load("franka"), np.random.default_rng(0)
ORIGIN = {
    "setups": ["franka"],
    "setup_digests": [""],
    "parameters": parameters_of(FRANKA),
    "rollout_version": VERSION,
    "chosen": 5,
    "conditions": ["a", "b"],
    "worlds": [{"setup": "franka"}] * 3,
    "models": {"0" * 64: 4},
}


def table(**changes):
    return CandidateTable(
        x=RNG.random((30, 48), dtype=np.float32),
        f=RNG.random((30, 3)),
        y=RNG.random((30, 3)),
        bad=RNG.random((30, 3, 2)),
        tau={model: RNG.random((30, 3, size)) for model, size in {**ORIGIN, **changes}["models"].items()},
        origin={**ORIGIN, **changes},
    )
