"""What a person asks for when starting a campaign."""

from dataclasses import dataclass
from pathlib import Path

from cluster.errors import UsageError
from cluster.hardware.events import canonical
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.proposals import fingerprint
from cluster.hardware.record.first_trials import FirstTrial, digest
from cluster.hardware.record.foresight import NO_FORESIGHT, Foresight
from cluster.hardware.states import Approval
from cluster.hardware.status import RANDOM_TRIALS
from cluster.inputs import search_working_directory
from cluster.optimization import methods
from cluster.optimization.candidates import require_usable
from cluster.optimization.factory import DRAWS
from workers.dataset.shards import sha256
from workers.hardware import robots
from workers.hardware.robots import LONGEST_PACE_SECONDS
from workers.setups import SETUPS, registry


@dataclass(frozen=True)
class CampaignPlan:
    """What a person asks for.

    Attributes:
        identity: of the campaign.
        folder: of its journal and ledger, on a local disk of the robot's machine; kept absolute.
        model: checkpoint, kept absolute; None for a method without one.
        pace: least duration of a trial on a rehearsal robot, in s, at most a day.
        candidates: table of simulated ones, kept absolute; None where the campaign draws its own.
        home: of the robot, kept absolute; None for its usual one.
        first: trials that it shares with another campaign; none where it has its own.
        foresight: how what waits for a person is simulated for them.
    """

    identity: CampaignIdentity
    folder: Path
    model: Path | None
    pace: float
    candidates: Path | None = None
    home: Path | None = None
    first: tuple[FirstTrial, ...] = ()
    foresight: Foresight = NO_FORESIGHT

    def __post_init__(self) -> None:
        if not 0.0 <= self.pace <= LONGEST_PACE_SECONDS:
            raise UsageError(f"pace must lie in [0, {LONGEST_PACE_SECONDS:.0f}] s, got {self.pace}")
        # The process that carries it out has a working directory of its own.
        object.__setattr__(self, "folder", self.folder.absolute())
        for field in ("model", "candidates", "home"):
            path = getattr(self, field)
            object.__setattr__(self, field, path and path.absolute())


def identify(
    robot: str,
    method: str,
    trials: int,
    seed: int,
    pool: int,
    model: Path | None,
    approval: Approval,
    candidates: Path | None = None,
    avoid: float = 0.0,
    first: tuple[FirstTrial, ...] = (),
) -> CampaignIdentity:
    """Check the arguments of a campaign, and make its identity of them.

    Args:
        robot: in the registry.
        method: of `svaedc.bo.methods`.
        trials: suggested trials after the random ones, at least 0.
        seed: of every random draw, at least 0.
        pool: number of random controllers the method chooses from, at least 1.
        model: checkpoint; ignored by methods without a model.
        approval: who approves.
        candidates: table of simulated ones; None where the campaign draws its own.
        avoid: root mean square difference of parameters, in [0, 1]; nothing nearer than this to a controller
            that failed or was rejected is proposed.
        first: trials that it shares with another campaign.

    Returns:
        The identity; its model is "" where the method needs none.

    Raises:
        UsageError: when a name or number is none that exists; the message names the nearest.
        UserError: when the model or the candidates cannot be read, or the candidates are of another robot.
    """
    try:
        search_working_directory()
        known, needs_model = robots.find(robot), methods.needs_model(method)
        if approval is Approval.POLICY and not known.simulated:
            raise UsageError(
                f"--approval policy lets every trial run by itself: {robot!r} must be a simulated stand-in "
                "for it, and is none; say --approval operator"
            )
        if needs_model and model is None:
            raise UsageError(f"method {method!r} needs a trained model, got none; give one with --model")
        checkpoint = fingerprint(model) if needs_model and model else ""
        if methods.needs_candidates(method) and candidates is None:
            raise UsageError(
                f"method {method!r} needs candidates that were simulated, got none: make some with "
                "`svaedc candidates` and name their folder with --candidates"
            )
        if candidates is not None:
            encoders = [model] if needs_model and model else []
            require_usable(candidates, registry.load(known.setup), encoders, RANDOM_TRIALS)
        return CampaignIdentity(
            robot,
            known.setup,
            method,
            seed,
            checkpoint,
            pool,
            trials,
            approval,
            DRAWS,
            _codes(known.setup, method),
            sha256(candidates) if candidates is not None else "",
            avoid,
            digest(first),
        )
    except (LookupError, ValueError) as error:
        raise UsageError(str(error.args[0])) from error


def _codes(setup: str, method: str) -> str:
    """The code of what is a user's own, as JSON; "" where nothing is."""
    codes = {setup: "" if setup in SETUPS else registry.find(setup).code, method: methods.code(method)}
    own = {name: code for name, code in codes.items() if code}
    return canonical(own) if own else ""
