"""The console as an application: its addresses together, and what it says where something is wrong."""

import re
from typing import Final
from urllib.parse import quote

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.exceptions import HTTPException

from cluster.console import decisions, entrance, looks
from cluster.console.asking import Console, console_of, wants_json
from cluster.console.sessions import COOKIE
from cluster.errors import UsageError, UserError
from cluster.hardware.database import JournalCorrupt, JournalError
from cluster.hardware.operator import Outdated

_TITLES: Final = {
    401: "Enter first",
    403: "Not allowed",
    404: "Not there",
    409: "Nothing was done: something has happened since",
}


def application(console: Console) -> FastAPI:
    """The console as an ASGI application; the guards come before it."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.state.console = console
    for part in (entrance, looks, decisions):
        app.include_router(part.router)
    for kind in (UserError, HTTPException, RequestValidationError):
        app.add_exception_handler(kind, _explain)
    return app


async def _explain(request: Request, error: Exception) -> Response:
    """What was wrong, for a person or for a program (RFC 9457)."""
    status, detail = _status_of(error), _detail_of(error)
    title = _TITLES.get(status, "Nothing was done")
    if wants_json(request):
        body = {"title": title, "status": status, "detail": detail}
        return JSONResponse(body, status, media_type="application/problem+json")
    if status == 401 and request.method == "GET":
        return RedirectResponse("/enter", 303)
    console = console_of(request)
    session = console.sessions.find(request.cookies.get(COOKIE, ""))
    back = re.sub(r"/[a-z]+$", "", request.url.path) if request.method == "POST" else "/"
    return HTMLResponse(console.pages.message(title, detail, quote(back) or "/", session), status)


def _status_of(error: Exception) -> int:
    if isinstance(error, HTTPException):
        return error.status_code
    if isinstance(error, RequestValidationError):
        return 404
    if isinstance(error, UsageError):
        return 422
    has_moved_on = isinstance(error, Outdated | JournalError) and not isinstance(error, JournalCorrupt)
    return 409 if has_moved_on else 500


def _detail_of(error: Exception) -> str:
    if isinstance(error, RequestValidationError):
        return "there is no such address"
    return str(error.detail) if isinstance(error, HTTPException) else str(error)
