"""Who may look at a robot's console, and who may decide: named tokens, of which only hashes are kept."""

import hashlib
import hmac
import json
import secrets
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from cluster.errors import UsageError, UserError
from cluster.hardware.events import utc_now
from workers.host import durable

FILE: Final = "tokens.json"
_BYTES: Final = 24
_LONGEST_NAME: Final = 80


class Role(StrEnum):
    """What somebody may do; an operator may do all that a viewer may."""

    VIEWER = "viewer"
    OPERATOR = "operator"

    def may(self, needed: "Role") -> bool:
        """Whether this role is enough."""
        return self is Role.OPERATOR or needed is Role.VIEWER


@dataclass(frozen=True)
class Token:
    """What is kept of a token.

    Attributes:
        role: what it allows.
        sha256: of the token; the token itself is kept nowhere.
        since: UTC time, ISO 8601.
    """

    role: Role
    sha256: str
    since: str


@dataclass(frozen=True)
class Person:
    """Somebody with a token.

    Attributes:
        name: as the journal will know them.
        token: that they entered with.
    """

    name: str
    token: Token

    @property
    def role(self) -> Role:
        """What they may do."""
        return self.token.role


class AccessTokens:
    """The tokens of one robot's console.

    Args:
        home: the robot's, in which their file lies, readable by its owner alone.
    """

    def __init__(self, home: Path) -> None:
        self._path = home / FILE

    def issue(self, name: str, role: Role) -> str:
        """Make a token for a person; an earlier one of that name ends.

        Args:
            name: of the person.
            role: what it allows.

        Returns:
            The token, which cannot be shown again.

        Raises:
            UsageError: the name is none.
            UserError: the file cannot be written.
        """
        name = name.strip()
        if not name or len(name) > _LONGEST_NAME or not name.isprintable():
            raise UsageError(f"a token needs the name of a person, got {name!r:.100}")
        token = secrets.token_urlsafe(_BYTES)
        with self._alone():
            self._write({**self.all(), name: Token(role, _hash(token), utc_now().isoformat())})
        return token

    def revoke(self, name: str) -> None:
        """End a person's token; pages that are open end with it.

        Raises:
            UsageError: nobody of that name has one.
        """
        with self._alone():
            known = dict(self.all())
            if known.pop(name, None) is None:
                raise UsageError(
                    f"nobody called {name!r} has a token; there are: {', '.join(known) or 'none'}"
                )
            self._write(known)

    def all(self) -> Mapping[str, Token]:
        """Every token by the name of its person.

        Raises:
            UserError: the file is damaged.
        """
        try:
            found = json.loads(self._path.read_bytes())
            return {
                name: Token(Role(each["role"]), each["sha256"], each["since"]) for name, each in found.items()
            }
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise UserError(
                f"{self._path} cannot be used ({error}): remove it, and give tokens anew with "
                "svaedc hardware token"
            ) from error

    def person(self, token: str) -> Person | None:
        """Whose token this is; None for nobody's."""
        asked, found = _hash(token), None
        for name, each in self.all().items():  # all of them, so that the time tells nothing
            if hmac.compare_digest(each.sha256, asked):
                found = Person(name, each)
        return found

    def knows(self, person: Person) -> bool:
        """Whether a person's token is still the one that they entered with."""
        return self.all().get(person.name) == person.token

    def _alone(self) -> AbstractContextManager[None]:
        return durable.exclusively(self._path.with_suffix(".lock"))

    def _write(self, tokens: Mapping[str, Token]) -> None:
        content = {name: asdict(each) for name, each in tokens.items()}
        try:
            durable.replace(self._path, json.dumps(content, indent=2).encode() + b"\n", mode=0o600)
        except OSError as error:
            raise UserError(f"cannot write {self._path}: {error.strerror}") from error


def _hash(token: str) -> str:
    """A token is random and long, so a plain hash of it cannot be reversed."""
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).hexdigest()
