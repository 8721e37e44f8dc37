"""What a check found."""

from dataclasses import dataclass
from enum import StrEnum


class Severity(StrEnum):
    """How much a finding weighs."""

    MISTAKE = "mistake"
    """Nothing that is collected is of use before it is mended."""
    DOUBT = "doubt"
    """It may be meant; look at it before many episodes are collected."""
    FACT = "fact"
    """It is only said."""


@dataclass(frozen=True)
class Remark:
    """One thing that a check has to say.

    Attributes:
        check: its name.
        severity: how much it weighs.
        text: what is the matter, and the remedy.
    """

    check: str
    severity: Severity
    text: str
