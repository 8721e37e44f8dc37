"""`svaedc hardware token`: who may enter a robot's console."""

from collections.abc import Iterator
from pathlib import Path

from cluster.console.access import AccessTokens, Role
from cluster.errors import UsageError
from cluster.hardware.events import moment_in_words
from cluster.hardware.robot.residence import home_of, robot_errors


def change(robot: str, home: Path | None, add: str | None, role: str, revoke: str | None) -> Iterator[str]:
    """Give a token, end one, and tell who has one.

    Args:
        robot: its name.
        home: folder that a person named; None for the usual one.
        add: person who gets one.
        role: of that person.
        revoke: person whose token ends.

    Yields:
        Lines.

    Raises:
        UsageError: there is no such role, or nobody of that name has a token.
        UserError: the file of tokens is damaged, or cannot be written.
    """
    if role not in list(Role):
        raise UsageError(f"--role must be one of {', '.join(Role)}, got {role!r}")
    with robot_errors():
        tokens = AccessTokens(home_of(robot, home).make().path)
        if revoke is not None:
            tokens.revoke(revoke)
            yield f"the token of {revoke} has ended"
        if add is not None:
            yield f"the token of {add}, {role}, shown this once: {tokens.issue(add, Role(role))}"
    known = tokens.all()
    for name, each in known.items():
        yield f"{name}: {each.role}, since {moment_in_words(each.since)} UTC"
    if not known:
        yield f"nobody may enter the console of {robot} yet"
