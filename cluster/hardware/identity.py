"""What makes a hardware campaign this one and no other."""

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from typing import Any

from cluster.errors import UserError
from cluster.hardware.events import canonical
from cluster.hardware.states import Approval
from cluster.optimization import methods
from workers.plug_ins import file_name
from workers.setups import registry


class IdentityMismatch(UserError):  # noqa: N818 - it is an expected refusal, not a defect
    """A folder holds another campaign than the one asked for."""


@dataclass(frozen=True)
class CampaignIdentity:
    """The arguments from which every proposal of a campaign follows, and who approves them.

    Attributes:
        robot: name in the registry.
        setup: name of the robot's setup.
        method: that suggests the controllers.
        seed: of every random draw, at least 0.
        model: SHA-256 of the checkpoint; "" for a method without a model.
        pool: number of random controllers the method chooses from, at least 1.
        trials: suggested trials after the random ones, at least 0.
        approval: who lets a controller onto the robot.
        draws: version of how controllers are drawn, `DRAWS` of the factory; nobody asks for one, a
            campaign keeps the one that it began with.
        codes: SHA-256 of the files of a user's own setup and method by their names, as JSON; "" where both
            ship, and of campaigns that began before there was such a field.
        candidates: SHA-256 of the table of simulated candidates that it chooses among; "" for none.
        avoid: root mean square difference of parameters, in [0, 1]; nothing nearer than this to a controller
            that failed or was rejected is proposed. 0 avoids that controller alone; campaigns of before do.
        first: SHA-256 of the first trials that it shares with another campaign; "" where it has its own.
    """

    robot: str
    setup: str
    method: str
    seed: int
    model: str
    pool: int
    trials: int
    approval: Approval
    draws: int = 1
    codes: str = ""
    candidates: str = ""
    avoid: float = 0.0
    first: str = ""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must be at least 0, got {self.seed}")
        if self.pool < 1:
            raise ValueError(f"pool must be at least 1, got {self.pool}")
        if self.trials < 0:
            raise ValueError(f"trials must be at least 0, got {self.trials}")
        if not 0.0 <= self.avoid <= 1.0:
            raise ValueError(f"avoid must lie in [0, 1], got {self.avoid}")

    def genesis(self, name: str) -> str:
        """Hash that the first event of the campaign called `name` follows."""
        return hashlib.sha256(canonical({**self.facts(), "name": name}).encode()).hexdigest()

    def facts(self) -> dict[str, Any]:
        """All fields by name; what campaigns of before lack is left out of them."""
        return {field: value for field, value in asdict(self).items() if (field, value) not in _BEFORE}

    def require(self, asked: "CampaignIdentity", place: str) -> None:
        """Refuses another campaign in the same folder.

        Args:
            asked: identity of the campaign that wants to go on here.
            place: the journal, for the message.

        Raises:
            IdentityMismatch: naming the first field that differs.
        """
        if self.codes and asked.codes:
            self._require_codes(asked, place)
        kept = replace(self, draws=asked.draws, codes=asked.codes, avoid=self.avoid or asked.avoid)
        for field, here in asdict(kept).items():
            there = getattr(asked, field)
            if here != there:
                raise IdentityMismatch(
                    f"{place} holds a campaign with {field} {str(here)!r}, asked for {str(there)!r}; "
                    f"repeat the command with {field} {str(here)!r} or choose another folder"
                )

    def _require_codes(self, asked: "CampaignIdentity", place: str) -> None:
        here, there = json.loads(self.codes), json.loads(asked.codes)
        for name, kind in ((self.setup, registry.KIND), (self.method, methods.KIND)):
            if here.get(name) != there.get(name, here.get(name)):
                raise IdentityMismatch(
                    f"{file_name(name, kind)} has changed since the campaign in {place} was begun; put the "
                    "file back as it was, or choose another folder"
                )


_BEFORE = (("draws", 1), ("codes", ""), ("candidates", ""), ("avoid", 0.0), ("first", ""))
