"""What every request must obey before any page sees it: its host, its origin, its length."""

from collections.abc import Collection, Iterable
from typing import Final

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

FORM_BYTES: Final = 64 * 1024
FILE_BYTES: Final = 512 * 1024 * 1024


def policy(stop_url: str) -> str:
    """The content policy of every page: nothing from elsewhere, forms to us and to STOP alone."""
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; media-src 'self'; "
        f"connect-src 'self'; form-action 'self' {stop_url}; base-uri 'none'; frame-ancestors 'none'"
    )


class Guards:
    """Stands before the application.

    Args:
        app: behind it.
        hosts: names, with port, that this console is known by.
        scheme: http or https.
        stop_url: where the form of STOP goes.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str], scheme: str, stop_url: str) -> None:
        self._app, self._hosts = app, frozenset(hosts)
        self._origins = frozenset(f"{scheme}://{host}" for host in hosts)
        self._headers = [
            (b"content-security-policy", policy(stop_url).encode()),
            (b"x-content-type-options", b"nosniff"),
            (b"referrer-policy", b"same-origin"),
            (b"cross-origin-opener-policy", b"same-origin"),
            (b"cross-origin-resource-policy", b"same-origin"),
        ]
        if scheme == "https":
            self._headers.append((b"strict-transport-security", b"max-age=31536000"))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = {name.lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refused = self._objection(scope["method"], headers, _limit(scope["path"]))
        if refused:
            await _refuse(send, *refused)
            return

        async def guarded_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*_headers_of(message["headers"]), *self._headers]}
            await send(message)

        await self._app(scope, _counting(receive, _limit(scope["path"])), guarded_send)

    def _objection(self, method: str, headers: dict[bytes, str], limit: int) -> tuple[int, str] | None:
        if headers.get(b"host", "") not in self._hosts:
            known = ", ".join(sorted(self._hosts))
            return 421, f"this console is known as {known}; open one of these, or start it with --name"
        length = headers.get(b"content-length", "0")
        if not length.isdigit():
            return 400, "the length of a request must be a number"
        if int(length) > limit:
            return 413, _too_long(limit)
        if method not in ("GET", "HEAD") and not self._is_ours(headers):
            return 403, "a form of another site is not taken; open the console itself"
        return None

    def _is_ours(self, headers: dict[bytes, str]) -> bool:
        """A browser says where a form came from; a program, which has no cookie, need not."""
        origin = headers.get(b"origin")
        if origin is None:
            return b"cookie" not in headers and b"authorization" in headers
        return origin in self._origins


def _limit(path: str) -> int:
    return FILE_BYTES if path.endswith("/attach") else FORM_BYTES


def _too_long(limit: int) -> str:
    return f"a request of at most {limit // 1024} kB is taken here"


def _counting(receive: Receive, limit: int) -> Receive:
    """The same body, as long as it is not too long, whatever its header says."""
    taken = 0

    async def counted() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > limit:
            raise HTTPException(413, _too_long(limit))  # where the body is read, so that it is told
        return message

    return counted


def _headers_of(headers: Iterable[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Nothing is kept by the browser, but for what says otherwise."""
    found = list(headers)
    if not any(name.lower() == b"cache-control" for name, _ in found):
        found.append((b"cache-control", b"no-store"))
    return found


async def _refuse(send: Send, status: int, reason: str) -> None:
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{reason}\n".encode()})
