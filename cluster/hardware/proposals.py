"""From a campaign's plan to the method that proposes its controllers."""

import hashlib
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from cluster.errors import UserError
from cluster.hardware.campaign import Suggest
from cluster.hardware.identity import CampaignIdentity
from svaedc.bo import methods
from svaedc.bo.candidates import Problem
from svaedc.bo.distribution_features import Densities
from svaedc.bo.features import Latents
from svaedc.bo.online import Adjustable
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from workers.randomness import generator
from workers.setups import Setup

LIBRARIES = ("numpy", "torch", "gpytorch", "botorch")


@dataclass(frozen=True)
class Proposals:
    """A campaign's method, and what its model expects of a controller.

    Attributes:
        suggest: the method.
        latents: of the model; None for a method without one.
    """

    suggest: Suggest
    latents: Latents | None

    @classmethod
    def of(cls, identity: CampaignIdentity, setup: Setup, model: Path | None) -> "Proposals":
        """Builds the method from the campaign's identity alone, so that every process builds the same.

        Raises:
            LookupError: when there is no such method.
            UserError: when the model is missing, damaged, or another setup's.
        """
        pool = (
            generator(identity.seed, "pool", 0).random((identity.pool, setup.dimensions)).astype(np.float32)
        )
        problem = Problem(setup.dimensions, setup.objective_limits, pool)
        if methods.needs_model(identity.method):
            network = _network(identity, model)
            latents = Latents.of(torch.tensor(pool), network.latent_means)
            densities, adjustable = Densities.of(network), Adjustable(network)
            problem = replace(problem, latents=latents, densities=densities, adjustable=adjustable)
        return cls(methods.build(identity.method, problem).suggest, problem.latents)

    def predicted_badness(self, x: Float[np.ndarray, " D"]) -> float | None:
        """Badness of x as the model expects it, in [0, 1]; None without a model."""
        if self.latents is None:
            return None
        return float(self.latents.means(torch.tensor(x[None]))[1])


def fingerprint(model: Path | None) -> str:
    """SHA-256 of a checkpoint file; "" for none.

    Raises:
        UserError: when the file cannot be read.
    """
    if model is None:
        return ""
    try:
        with model.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UserError(
            f"cannot read the model {model}: {error.strerror}; name a checkpoint of svaedc train"
        ) from error


def library_versions() -> dict[str, str]:
    """Versions of the libraries whose arithmetic a proposal depends on."""
    return {library: version(library) for library in LIBRARIES}


def _network(identity: CampaignIdentity, model: Path | None) -> SvaeDc:
    if model is None:
        raise UserError(f"method {identity.method!r} needs a trained model, got none; give one with --model")
    if fingerprint(model) != identity.model:
        raise UserError(f"the model {model} is not the one this campaign was planned with; restore that file")
    try:
        network, metadata = checkpoint.load(model)
        checkpoint.require(model, metadata, {"setup": identity.setup})
    except ValueError as error:
        raise UserError(str(error)) from error
    return network.requires_grad_(requires_grad=False)
