"""Addresses at which people come and go, and what every page looks like."""

from fastapi import APIRouter, HTTPException, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from cluster.console.asking import Form, Ours, Visitor, require_own_form
from cluster.console.pages import STATIC, static
from cluster.console.sessions import COOKIE, LIFETIME_SECONDS

router = APIRouter()


@router.get("/enter", response_class=HTMLResponse)
def entrance(console: Ours) -> str:
    """Ask for a token."""
    return console.pages.enter("")


@router.post("/enter")
def enter(console: Ours, form: Form) -> Response:
    """Let a browser in that brings a token; says so where it does not."""
    sessions = console.sessions
    if sessions.is_guessed_at:
        wait = "too many wrong tokens: wait a minute, then try again"
        return HTMLResponse(console.pages.enter(wait), 429)
    person = console.tokens.person(form.get("token", "").strip())
    if person is None:
        sessions.note_failure()
        return HTMLResponse(console.pages.enter("this token is not known here"), 401)
    answer = RedirectResponse("/", 303)
    answer.set_cookie(
        COOKIE,
        sessions.begin(person),
        max_age=int(LIFETIME_SECONDS),
        secure=console.is_secure,
        httponly=True,
        samesite="strict",
    )
    return answer


@router.post("/leave")
def leave(console: Ours, request: Request, session: Visitor, form: Form) -> Response:
    """End a browser's session."""
    require_own_form(session, form.get("key", ""))
    console.sessions.end(request.cookies.get(COOKIE, ""))
    answer = RedirectResponse("/enter", 303)
    answer.delete_cookie(COOKIE)
    return answer


@router.get("/static/{name}")
def file(name: str) -> Response:
    """A style sheet or a script."""
    try:
        return Response(static(name), media_type=STATIC[name], headers={"cache-control": "max-age=300"})
    except KeyError:
        raise HTTPException(404, "there is no such file") from None
