"""What a paper claims of its methods, and the numbers that answer it."""

from dataclasses import dataclass

from svaedc.evidence import Evidence


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, or a question of this project, and the numbers that answer it.

    Attributes:
        text: What is claimed.
        source: Where it stands in the paper; "control" for what the paper does not say.
        evidence: All of it has to hold.
    """

    text: str
    source: str
    evidence: tuple[Evidence, ...]

    def __post_init__(self) -> None:
        """Refuse a claim that nothing could answer."""
        if not self.evidence:
            raise ValueError(f"a claim needs at least one piece of evidence, got none for {self.text!r}")
