"""Who asks, and what their form says: what the console's addresses share."""

import math
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import parse_qs

from fastapi import Depends, HTTPException, Request

from cluster.console.access import AccessTokens, Person, Role
from cluster.console.desk import Desk
from cluster.console.pages import Pages
from cluster.console.sessions import COOKIE, BrowserSession, Sessions
from cluster.errors import UsageError


@dataclass(frozen=True)
class Console:
    """What the application is made of.

    Attributes:
        desk: of the campaign.
        tokens: of the robot.
        pages: that are shown.
        is_secure: whether browsers are reached through TLS.
        sessions: browsers that are logged in.
        closing: is set when the console ends; pages that listen are let go then.
    """

    desk: Desk
    tokens: AccessTokens
    pages: Pages
    is_secure: bool
    sessions: Sessions
    closing: threading.Event


def console_of(request: Request) -> Console:
    """The console that a request is for."""
    found: Console = request.app.state.console
    return found


def visitor(request: Request) -> BrowserSession:
    """Who asks: the browser of a session, or a program with a token.

    Raises:
        HTTPException: nobody who is known.
    """
    console = console_of(request)
    kind, _, token = request.headers.get("authorization", "").partition(" ")
    if kind.lower() == "bearer":
        person = console.tokens.person(token.strip())
        if person is None:
            raise HTTPException(401, "this token is not known here")
        return BrowserSession(person, "", math.inf)
    session = console.sessions.find(request.cookies.get(COOKIE, ""))
    if session is None or not console.tokens.knows(session.person):
        raise HTTPException(401, "enter first")
    return session


async def fields(request: Request) -> Mapping[str, str]:
    """The fields of a form; of a field that comes twice, the first."""
    body = (await request.body()).decode("utf-8", "replace")
    try:
        return {name: values[0] for name, values in parse_qs(body, max_num_fields=50).items()}
    except ValueError as error:
        raise HTTPException(400, "a form has at most 50 fields") from error


def require_own_form(session: BrowserSession, key: str) -> None:
    """Refuse a form that another site made.

    Args:
        session: of who sends it.
        key: that it holds.

    Raises:
        HTTPException: it is not of a page of this session.
    """
    if not session.holds(key):
        raise HTTPException(403, "this form is of another session: load the page again")


def version_in(form: Mapping[str, str]) -> int:
    """The version of the trial that the page showed.

    Raises:
        UsageError: the form does not say.
    """
    value = form.get("seen", "")
    if not re.fullmatch(r"\d{1,9}", value):
        raise UsageError(f"a decision says which version of the trial was seen, got {value!r:.40}")
    return int(value)


def number_in(form: Mapping[str, str], name: str) -> float | None:
    """A number that a person typed, in the way of their country if need be.

    Args:
        form: the fields.
        name: of the field.

    Returns:
        The number; None where nothing was typed.

    Raises:
        UsageError: it is no number.
    """
    text = form.get(name, "").strip().replace(",", ".").replace("−", "-")
    try:
        return float(text) if text else None
    except ValueError:
        raise UsageError(f"{name} must be a number, got {text!r:.40}") from None


def wants_json(request: Request) -> bool:
    """Whether a program asks."""
    return "application/json" in request.headers.get("accept", "")


Ours = Annotated[Console, Depends(console_of)]
Visitor = Annotated[BrowserSession, Depends(visitor)]
Form = Annotated[Mapping[str, str], Depends(fields)]


def operator_in(session: BrowserSession, key: str) -> Person:
    """Tell which operator asks.

    Args:
        session: of who asks.
        key: that their form holds.

    Returns:
        The operator.

    Raises:
        HTTPException: they may not decide, or the form is not of their own pages.
    """
    if not session.person.role.may(Role.OPERATOR):
        raise HTTPException(403, f"{session.person.name} may look, and not decide")
    require_own_form(session, key)
    return session.person


def decider(session: Visitor, form: Form) -> Person:
    """Tell which operator sent a form; see `operator_in`.

    Args:
        session: of who sends it.
        form: its fields.

    Returns:
        The operator.
    """
    return operator_in(session, form.get("key", ""))


Decider = Annotated[Person, Depends(decider)]
