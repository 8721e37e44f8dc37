"""The SVAE-DC model: its four networks and the evidence lower bound that trains them."""

from collections.abc import Sequence
from typing import Final, NamedTuple, final

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from svaedc.data.episodes import Episodes
from svaedc.model.config import ModelConfig
from svaedc.model.distributions import Diagonal, kl_divergence
from svaedc.model.networks import HEADS, PRIORS, Badness, DenseHead, Encoder, LowRankHead, PlanOf, PlanPrior
from svaedc.model.normalizer import POSTERIOR_INPUTS, Normalizer, measure

STATISTICS_SAMPLE: Final = 2_000
"""The decoder's start is measured on so many trajectories; more change it by less than one percent."""


class ElboTerms(NamedTuple):
    """Terms of the lower bound of each episode, before any weighting.

    Attributes:
        log_p_xi: log p(xi|tau), trajectories in parts of the observation range.
        log_p_y: log p(y|psi).
        kl: KL(q(tau, psi|xi, y) || p(tau, psi|x)).
    """

    log_p_xi: Float[Tensor, " batch"]
    log_p_y: Float[Tensor, " batch"]
    kl: Float[Tensor, " batch"]


@final
class SvaeDc(nn.Module):
    """Sequential variational auto-encoder with dynamic compression (paper, sections 3 and 5).

    Generative: p(tau, psi, xi, y | x) = p(tau, psi|x) p(y|psi) p(xi|tau). Posterior: q(tau, psi | xi, y).
    Trajectories go in and come out in SI units, channel-major; controllers live in the unit cube.

    Without psi (`ModelConfig.psi_dim` 0) it is the SVAE of equation (elbo_simple): log p(y|psi) is left out,
    and the predicted badness is 0 everywhere, so that nothing is compressed.
    """

    def __init__(self, config: ModelConfig) -> None:
        """Build untrained networks; `initialized_model` also measures the data they start from."""
        super().__init__()
        self.config = config
        self.normaliser = Normalizer(config.observation_dim, config.time_steps)
        self.posterior_network = Encoder(config)
        self.prior_network = PRIORS[config.prior](config)
        self.decoder: DenseHead | LowRankHead = HEADS[config.head](config)
        self.badness = Badness(config) if config.has_psi else None

    @property
    def reads_plans(self) -> bool:
        """Whether p(tau, psi|x) reads what a controller wants, which code of the robot computes."""
        return isinstance(self.prior_network, PlanPrior)

    def known_plan_of(self) -> PlanOf:
        """What computes plans.

        Raises:
            TypeError: This model reads none, or nobody has said what computes them.
        """
        plan_of = self.prior_network.plan_of if isinstance(self.prior_network, PlanPrior) else None
        if plan_of is None:
            raise TypeError("this model reads no plans, or is to be told by read_plans what computes them")
        return plan_of

    def read_plans(self, plan_of: PlanOf) -> None:
        """Say what computes plans; a model that reads none ignores it.

        Args:
            plan_of: Plans [batch, channels, steps] of controllers [batch, D], about -1 to 1.
        """
        if isinstance(self.prior_network, PlanPrior):
            self.prior_network.plan_of = plan_of

    def forward(
        self,
        x: Float[Tensor, "batch controller"],
        xi: Float[Tensor, "batch obs time"],
        bad: Float[Tensor, "batch time"],
        y: Float[Tensor, " batch"],
    ) -> ElboTerms:
        """Terms of equation (elbo_dc_simple) for one draw of q; its last two terms are -KL in closed form.

        Args:
            x: Controllers in the unit cube, [batch, D].
            xi: Trajectories in SI units, [batch, obs, time].
            bad: 1 at each bad step, else 0, [batch, time].
            y: Badness of each episode in [0, 1], [batch].

        Returns:
            Each term of each episode, unweighted, [batch].
        """
        q = self.posterior(xi, bad, y)
        tau, psi = self.split(q.rsample())
        return ElboTerms(
            log_p_xi=self.p_xi(tau).log_prob(self.normaliser.normalize(xi)),
            log_p_y=self.p_y(psi).log_prob(y) if self.config.has_psi else torch.zeros_like(y),
            kl=kl_divergence(q, self.prior(x)),
        )

    def elbo(
        self,
        x: Float[Tensor, "batch controller"],
        xi: Float[Tensor, "batch obs time"],
        bad: Float[Tensor, "batch time"],
        y: Float[Tensor, " batch"],
    ) -> Float[Tensor, " batch"]:
        """Unweighted evidence lower bound for one draw of q, equation (elbo_dc_simple).

        Args:
            x: Controllers in the unit cube, [batch, D].
            xi: Trajectories in SI units, [batch, obs, time].
            bad: 1 at each bad step, else 0, [batch, time].
            y: Badness of each episode in [0, 1], [batch].

        Returns:
            The bound of each episode, [batch].
        """
        log_p_xi, log_p_y, kl = self(x, xi, bad, y)
        return log_p_xi + log_p_y - kl

    def generation_terms(
        self,
        p: Diagonal,
        xi: Float[Tensor, "batch obs time"],
        y: Float[Tensor, " batch"],
    ) -> tuple[Float[Tensor, " batch"], Float[Tensor, " batch"]]:
        """Terms of the bound at the means of p(tau, psi|x): what x alone tells.

        Args:
            p: p(tau, psi|x), event `[latent]`.
            xi: Trajectories in SI units, [batch, obs, time].
            y: Badness of each episode in [0, 1], [batch].

        Returns:
            log p(xi|tau) and log p(y|psi) of each episode, [batch]; the second is 0 for an SVAE.
        """
        tau, psi = self.split(p.loc)
        log_p_y = self.p_y(psi).log_prob(y) if self.config.has_psi else torch.zeros_like(y)
        return self.p_xi(tau).log_prob(self.normaliser.normalize(xi)), log_p_y

    def posterior(
        self,
        xi: Float[Tensor, "batch obs time"],
        bad: Float[Tensor, "batch time"],
        y: Float[Tensor, " batch"],
    ) -> Diagonal:
        """Encode episodes.

        Args:
            xi: Trajectories in SI units, [batch, obs, time].
            bad: 1 at each bad step, else 0, [batch, time].
            y: Badness of each episode in [0, 1], [batch].

        Returns:
            q(tau, psi | xi, y), event `[latent]`.
        """
        seen = POSTERIOR_INPUTS[self.config.posterior_input](self.normaliser, xi)
        return self.posterior_network(seen, bad, y)

    def prior(self, x: Float[Tensor, "batch controller"]) -> Diagonal:
        """p(tau, psi | x), event `[latent]`."""
        return self.prior_network(x)

    def p_xi(self, tau: Float[Tensor, "batch tau"]) -> Diagonal:
        """p(xi | tau) of scaled trajectories, event `[obs, time]`."""
        return self.decoder(tau)

    def p_y(self, psi: Float[Tensor, "batch psi"]) -> Diagonal:
        """p(y | psi), event without dimensions.

        Raises:
            TypeError: An SVAE has no psi.
        """
        if self.badness is None:
            raise TypeError("p(y|psi) needs a model with psi, got an SVAE (psi_dim 0); train an SVAE-DC")
        return self.badness(psi)

    def badness_at(self, psi: Float[Tensor, "batch psi"]) -> Float[Tensor, " batch"]:
        """Mean of p(y | psi), in (0, 1); 0 everywhere for an SVAE, which knows nothing of badness."""
        return self.p_y(psi).loc if self.config.has_psi else psi.new_zeros(len(psi))

    def split(
        self, code: Float[Tensor, "batch latent"]
    ) -> tuple[Float[Tensor, "batch tau"], Float[Tensor, "batch psi"]]:
        """Latent code [tau, psi] into its two parts, each flattened over the path."""
        return code[:, : self.config.tau_size], code[:, self.config.tau_size :]

    def latent_means(
        self, x: Float[Tensor, "batch controller"]
    ) -> tuple[Float[Tensor, "batch tau"], Float[Tensor, " batch"]]:
        """E[tau|x], flattened, and the mean of p(y|psi_bar_x), what the kernels are made of (section 4)."""
        tau, psi = self.split(self.prior(x).loc)
        return tau, self.badness_at(psi)

    def generate(self, x: Float[Tensor, "batch controller"]) -> Float[Tensor, "batch obs time"]:
        """Trajectory of each controller, decoded from the mean of p(tau|x), in SI units."""
        tau, _ = self.split(self.prior(x).loc)
        return self.normaliser.denormalize(self.p_xi(tau).loc)

    def reconstruct(
        self,
        xi: Float[Tensor, "batch obs time"],
        bad: Float[Tensor, "batch time"],
        y: Float[Tensor, " batch"],
    ) -> Float[Tensor, "batch obs time"]:
        """Decode each trajectory from the mean of q(tau|xi, y).

        Args:
            xi: Trajectories in SI units, [batch, obs, time].
            bad: 1 at each bad step, else 0, [batch, time].
            y: Badness of each episode in [0, 1], [batch].

        Returns:
            Trajectories in SI units, [batch, obs, time].
        """
        tau, _ = self.split(self.posterior(xi, bad, y).loc)
        return self.normaliser.denormalize(self.p_xi(tau).loc)


def initialized_model(
    config: ModelConfig, training: Episodes, bounds: tuple[Sequence[float], Sequence[float]], seed: int
) -> SvaeDc:
    """Build a model whose buffers and decoder start from the training trajectories.

    Args:
        config: Sizes.
        training: Training episodes; a bounded sample of them is measured.
        bounds: Fixed lower and upper bounds of each observation (the setup's channels).
        seed: Determines the weights and the sample; torch's own generator is left as it was.

    Returns:
        The untrained model, on the CPU.

    Raises:
        ValueError: Episodes or bounds do not fit `config`.
    """
    training.require_sizes(config.controller_dim, config.observation_dim, config.time_steps)
    rng = np.random.default_rng(seed)
    sample = training.sample(STATISTICS_SAMPLE, rng)
    statistics = measure(np.asarray(sample.xi[sample.rows]), bounds, config.rank, rng)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = SvaeDc(config)
    model.normaliser.adopt(statistics)
    model.decoder.adopt(statistics)
    return model
