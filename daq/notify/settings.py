"""``notify.toml``: who is told when a verdict changes (docs/reference/notify-toml.md)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from daq.files.toml_file import read_toml
from robots.errors import UserError

Text = Annotated[str, Field(min_length=1)]
Url = Annotated[str, Field(pattern=r"^https?://[^\s]+$")]
Address = Annotated[str, Field(pattern=r"^[^\s@]+@[^\s@]+$")]


class NotifyError(UserError, ValueError):
    """A notify.toml that cannot be read; the text is one line for the user."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Webhook(_Frozen):
    """A JSON object is posted there."""

    url: Url = Field(description="where to")
    token_env: Text | None = Field(default=None, description="environment variable with a bearer token")


class Mail(_Frozen):
    """A mail by SMTP."""

    host: Text = Field(description="of the mail server")
    port: Annotated[int, Field(ge=1, le=65535)] = Field(default=587, description="of the mail server")
    encryption: Literal["starttls", "tls", "none"] = Field(
        default="starttls", description="of the connection"
    )
    user: Text | None = Field(default=None, description="to log in with")
    password_env: Text | None = Field(default=None, description="environment variable with the password")
    sender: Address = Field(description="From")
    to: Annotated[tuple[Address, ...], Field(min_length=1)] = Field(description="To")


class Apprise(_Frozen):
    """Any service that apprise knows; needs the extra ``notify``."""

    url_env: Text = Field(description="environment variable with the service's URL")


class NotifySettings(_Frozen):
    """Everybody who is told."""

    format: Literal[1]
    base_url: str = Field(
        default="", description="of `armhil serve`, for links; the report's path where absent"
    )
    attempts: Annotated[int, Field(ge=1, le=20)] = Field(default=6, description="per receiver")
    timeout: Annotated[float, Field(gt=0, le=60)] = Field(default=10.0, description="of one attempt, s")
    pause: Annotated[float, Field(gt=0, le=600)] = Field(
        default=5.0, description="before the second attempt, s; doubled each time"
    )
    log: Text | None = Field(
        default=None, description="file for what was sent; beside this file where absent"
    )
    webhook: tuple[Webhook, ...] = ()
    mail: tuple[Mail, ...] = ()
    apprise: tuple[Apprise, ...] = ()


def notify_path() -> Path:
    """$ARMHIL_NOTIFY, else notify.toml in the user's configuration folder."""
    named = os.environ.get("ARMHIL_NOTIFY")
    if named:
        return Path(named)
    home = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return home / "armhil" / "notify.toml"


def read_notify(path: Path) -> NotifySettings:
    """Read a notify.toml.

    Raises:
        NotifyError: one line with file, line, key and what is allowed.
    """
    return read_toml(path, NotifySettings, NotifyError, kind="who is told (notify.toml)")
