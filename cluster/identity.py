"""What makes a hardware campaign this one and no other."""

import hashlib
from dataclasses import asdict, dataclass

from cluster.errors import UserError
from cluster.events import canonical


class IdentityMismatch(UserError):  # noqa: N818 - it is an expected refusal, not a defect
    """A folder holds another campaign than the one asked for."""


@dataclass(frozen=True)
class Identity:
    """The arguments from which every proposal of a campaign follows.

    Attributes:
        robot: name in the registry.
        setup: name of the robot's setup.
        method: that suggests the controllers.
        seed: of every random draw, at least 0.
        model: SHA-256 of the checkpoint; "" for a method without a model.
        trials: suggested trials after the random ones, at least 0.
    """

    robot: str
    setup: str
    method: str
    seed: int
    model: str
    trials: int

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must be at least 0, got {self.seed}")
        if self.trials < 0:
            raise ValueError(f"trials must be at least 0, got {self.trials}")

    def genesis(self, name: str) -> str:
        """Hash that the first event of the campaign called `name` follows."""
        return hashlib.sha256(canonical({**asdict(self), "name": name}).encode()).hexdigest()

    def require(self, asked: "Identity", place: str) -> None:
        """Refuses another campaign in the same folder.

        Args:
            asked: identity of the campaign that wants to go on here.
            place: the journal, for the message.

        Raises:
            IdentityMismatch: naming the first field that differs.
        """
        for field, here in asdict(self).items():
            there = getattr(asked, field)
            if here != there:
                raise IdentityMismatch(
                    f"{place} holds a campaign with {field} {here!r}, asked for {there!r}; "
                    f"repeat the command with {field} {here!r} or choose another folder"
                )
