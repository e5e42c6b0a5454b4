"""Send one message to everybody, trying again with growing pauses; what came of it goes to a log file."""

from __future__ import annotations

import http.client
import json
import os
import smtplib
import ssl
import time
import urllib.parse
import urllib.request
from collections.abc import Callable
from datetime import UTC, datetime
from email.message import EmailMessage
from functools import partial
from pathlib import Path
from typing import Any

from daq.notify.notify import Message
from daq.notify.settings import Apprise, Mail, NotifySettings, Webhook

Receiver = tuple[str, Callable[[], None]]
"""What the log calls it, and what sends."""


def send_all(
    settings: NotifySettings, message: Message, logged: Path, sleep: Callable[[float], None] = time.sleep
) -> bool:
    """Tell everybody; True where all were reached.

    Args:
        settings: who.
        message: what.
        logged: file that gets a line per attempt.
        sleep: between attempts.
    """
    waiting = receivers(settings, message)
    pause = settings.pause
    for attempt in range(1, settings.attempts + 1):
        waiting = [one for one in waiting if not _tried(one, message, attempt, logged)]
        if not waiting:
            return True
        if attempt < settings.attempts:
            sleep(pause)
            pause *= 2
    return False


def receivers(settings: NotifySettings, message: Message) -> list[Receiver]:
    """Everybody who is to be told."""
    return [
        *(
            (f"webhook {masked(to.url)}", partial(_post, to, message, settings.timeout))
            for to in settings.webhook
        ),
        *(
            (f"mail {', '.join(to.to)}", partial(_mail, to, message, settings.timeout))
            for to in settings.mail
        ),
        *((f"apprise ${to.url_env}", partial(_apprise, to, message)) for to in settings.apprise),
    ]


def _tried(one: Receiver, message: Message, attempt: int, logged: Path) -> bool:
    name, send = one
    try:
        send()
    except http.client.HTTPException as error:  # no HTTP at all; its text may hold the address
        _note(logged, f"{name}: attempt {attempt} failed: {type(error).__name__}", message)
        return False
    except (OSError, smtplib.SMTPException, ValueError, RuntimeError) as error:
        _note(logged, f"{name}: attempt {attempt} failed: {type(error).__name__}: {error}", message)
        return False
    _note(logged, f"{name}: sent in attempt {attempt}", message)
    return True


def _note(logged: Path, text: str, message: Message) -> None:
    stamp = datetime.now(tz=UTC).isoformat(timespec="seconds")
    with os.fdopen(
        os.open(logged, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), "a", encoding="utf-8"
    ) as file:
        os.fchmod(file.fileno(), 0o600)  # one of an older version too
        file.write(f"{stamp} {' '.join(text.split())} ({message.subject})\n")


def masked(url: str) -> str:
    """An address without what may be a secret in it: user, path, query and fragment."""
    parts = urllib.parse.urlsplit(url)
    host = parts.netloc.rpartition("@")[2]
    return f"{parts.scheme}://{host}" + ("/…" if parts.path.strip("/") or parts.query else "")


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """A message, and the token with it, goes where the settings say and nowhere else."""

    def redirect_request(self, *_: Any) -> None:
        """Never; the answer is an error then."""


_OPENER = urllib.request.build_opener(_NoRedirect)


def _post(hook: Webhook, message: Message, timeout: float) -> None:
    headers = {"Content-Type": "application/json", "User-Agent": "armhil"}
    if hook.token_env is not None:
        headers["Authorization"] = f"Bearer {_secret(hook.token_env)}"
    data = json.dumps(message.as_dict(), ensure_ascii=False).encode()
    request = urllib.request.Request(hook.url, data, headers)  # noqa: S310 (the settings allow http and https only)
    with _OPENER.open(request, timeout=timeout) as answer:
        answer.read(1024)


def _mail(mail: Mail, message: Message, timeout: float) -> None:
    letter = EmailMessage()
    letter["Subject"], letter["From"], letter["To"] = message.subject, mail.sender, ", ".join(mail.to)
    letter.set_content(message.text)
    context = ssl.create_default_context()
    if mail.encryption == "tls":
        server: smtplib.SMTP = smtplib.SMTP_SSL(mail.host, mail.port, timeout=timeout, context=context)
    else:
        server = smtplib.SMTP(mail.host, mail.port, timeout=timeout)
    with server:
        if mail.encryption == "starttls":
            server.starttls(context=context)
        if mail.user is not None and mail.password_env is not None:
            server.login(mail.user, _secret(mail.password_env))
        server.send_message(letter)


def _apprise(service: Apprise, message: Message) -> None:
    try:
        from apprise import Apprise as Sender
    except ImportError:
        raise RuntimeError("apprise is not installed; allowed: armhil[notify]") from None
    sender = Sender()
    if not sender.add(_secret(service.url_env)):
        raise ValueError(f"${service.url_env} is no URL that apprise knows")
    if not sender.notify(title=message.subject, body=message.text):
        raise RuntimeError("apprise could not deliver it")


def _secret(name: str) -> str:
    value = os.environ.get(name)
    if not value:
        raise ValueError(f"environment variable {name} is not set")
    return value


def log_file(settings: NotifySettings, file: Path) -> Path:
    """Where attempts are noted."""
    return Path(settings.log) if settings.log is not None else file.with_suffix(".log")
