"""What stands before every request: allowed names, small bodies, tokens, headers."""

from __future__ import annotations

import hmac
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from http.cookies import CookieError, SimpleCookie
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from daq.service.settings import Service

COOKIE = "armhil_read"
LARGEST_BODY = 16_384
"""Bytes; nothing is uploaded here."""
MOST_GUESSES, GUESSING_TIME = 5, 60.0
"""Wrong tokens that a host may give within so many seconds."""
_MOST_HOSTS = 10_000
OPEN_PATHS = frozenset({"/login", "/static/service.css", "/static/report.css"})
"""Shown before somebody has said who they are."""

_POLICY = (
    "default-src 'none'; style-src 'self' 'unsafe-inline'; script-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)
_HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Guard:
    """ASGI middleware: refuses before a route sees anything.

    A foreign name in the Host header is refused, so that a page of somebody else cannot reach a service on
    this machine by a name of its own. A request that changes something has to carry its token in a header,
    which no form and no other page can send.
    """

    def __init__(self, app: ASGIApp, service: Service) -> None:
        self._app = app
        self._service = service
        self._hosts = {"localhost", "127.0.0.1", "[::1]", service.host, *service.hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal is not None:
            for name, value in _HEADERS.items():
                refusal.headers.setdefault(name, value)
            await refusal(scope, receive, send)
            return
        counted = _Counted(receive)

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, counted, with_headers)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if _name(host) not in self._hosts:
            return JSONResponse({"detail": "this service is not known by that name"}, 421)
        length = headers.get("content-length")
        if length is not None and (
            not length.isascii() or not length.isdigit() or int(length) > LARGEST_BODY
        ):
            return JSONResponse({"detail": f"a body may have {LARGEST_BODY} bytes"}, 413)
        if length is not None and "transfer-encoding" in headers:
            return JSONResponse({"detail": "a body has one length"}, 400)  # RFC 9112, 6.1: smuggled requests
        if length is None and "transfer-encoding" in headers:
            return JSONResponse({"detail": "say how long the body is"}, 411)
        if scope["method"] not in ("GET", "HEAD", "OPTIONS") and not _same_origin(headers, host):
            return JSONResponse({"detail": "sent from another site"}, 403)
        if self._service.read_token is None or scope["path"] in OPEN_PATHS:
            return None
        if _has_token(headers, (self._service.read_token, self._service.drive_token)):
            return None
        if "text/html" in headers.get("accept", "") and scope["method"] == "GET":
            return RedirectResponse(f"/login?after={quote(scope['path'])}", 303)
        return JSONResponse({"detail": "a token is needed"}, 401, {"WWW-Authenticate": "Bearer"})


class Guesses:
    """Wrong tokens by host: after a few, it has to wait before it is listened to again.

    Args:
        clock: s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._wrong: dict[str, deque[float]] = {}

    def wait(self, host: str) -> int:
        """s until the host may try again; 0 where it may now."""
        times = self._wrong.get(host, deque())
        while times and times[0] <= self._clock() - GUESSING_TIME:
            times.popleft()
        if not times:
            self._wrong.pop(host, None)
        return 0 if len(times) < MOST_GUESSES else math.ceil(times[0] + GUESSING_TIME - self._clock())

    def wrong(self, host: str) -> None:
        """One was wrong."""
        if len(self._wrong) >= _MOST_HOSTS:
            self._wrong.clear()
        self._wrong.setdefault(host, deque(maxlen=MOST_GUESSES)).append(self._clock())


class _Counted:
    """A request's body, no longer than it was said to be and than is allowed."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._left = LARGEST_BODY

    async def __call__(self) -> Message:
        message = await self._receive()
        if message["type"] == "http.request":
            self._left -= len(message.get("body", b""))
            if self._left < 0:
                return {"type": "http.disconnect"}
        return message


def may_drive(headers: Headers, service: Service) -> bool:
    """Whether a request carries the token to drive: in the header, a cookie is not enough."""
    given = _bearer(headers)
    return service.drive_token is not None and given is not None and _equal(given, service.drive_token)


def is_read_token(given: str, service: Service) -> bool:
    """Whether somebody may read."""
    return service.read_token is not None and _equal(given, service.read_token)


def _has_token(headers: Headers, tokens: tuple[str | None, ...]) -> bool:
    given = (_bearer(headers), _cookie(headers))
    return any(g is not None and t is not None and _equal(g, t) for g in given for t in tokens)


def _bearer(headers: Headers) -> str | None:
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if kind.lower() == "bearer" and token else None


def _cookie(headers: Headers) -> str | None:
    try:
        cookies = SimpleCookie(headers.get("cookie", ""))
    except CookieError:
        return None
    return cookies[COOKIE].value if COOKIE in cookies else None


def _equal(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "surrogateescape"), wanted.encode())


def _name(host: str) -> str:
    """The host of ``host:port``."""
    if host.startswith("["):
        return host.partition("]")[0] + "]"
    return host.partition(":")[0]


def _same_origin(headers: Headers, host: str) -> bool:
    if headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
        return False
    origin = headers.get("origin")
    return origin is None or origin.partition("://")[2] == host
