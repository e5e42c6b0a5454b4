"""``service.toml``: where the service listens and who may read and drive (docs/reference/service-toml.md)."""

from __future__ import annotations

import ipaddress
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from daq.files.toml_file import read_toml
from robots.errors import UserError

Text = Annotated[str, Field(min_length=1)]
LEAST_TOKEN = 16
"""Characters; a shorter token can be guessed."""


class ServiceError(UserError, ValueError):
    """A service that must not be started like this; one line for the user."""


class ServiceFile(BaseModel):
    """The configuration of the service."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    format: Literal[1]
    host: Text = Field(default="127.0.0.1", description="address to listen on")
    port: Annotated[int, Field(ge=0, le=65535)] = Field(default=8090, description="0 takes a free one")
    hosts: tuple[Text, ...] = Field(default=(), description="names by which browsers may call it besides")
    read_token_env: Text | None = Field(
        default=None, description="environment variable with the token to read"
    )
    drive: bool = Field(default=False, description="whether checks may be started over HTTP")
    drive_token_env: Text | None = Field(
        default=None, description="environment variable with the token to drive"
    )
    fleet: Text | None = Field(default=None, description="fleet.toml of the arms that may be driven")


@dataclass(frozen=True)
class Service:
    """A service that may be started.

    Attributes:
        host, port: to listen on.
        hosts: allowed in the Host header.
        read_token: asked for before anything is shown; nobody is asked where None.
        drive_token: asked for before anything moves; nothing ever moves where None.
        fleet: file of the arms that may be driven; the user's where None.
    """

    host: str = "127.0.0.1"
    port: int = 8090
    hosts: tuple[str, ...] = ()
    read_token: str | None = None
    drive_token: str | None = None
    fleet: Path | None = None

    @property
    def is_local(self) -> bool:
        """Whether only this machine can reach it."""
        return is_loopback(self.host)


def service_path() -> Path:
    """$ARMHIL_SERVICE, else service.toml in the user's configuration folder."""
    named = os.environ.get("ARMHIL_SERVICE")
    if named:
        return Path(named)
    home = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return home / "armhil" / "service.toml"


def read_service(path: Path | None, host: str | None = None, port: int | None = None) -> Service:
    """The service of a file, with what the command line says instead.

    Raises:
        ServiceError: one line: a file that cannot be read, an address that others reach without a token, a
            token that is missing or short.
    """
    file = path or service_path()
    if path is None and not file.exists():
        found = ServiceFile(format=1)
    else:
        found = read_toml(file, ServiceFile, ServiceError, kind="a service (service.toml)")
    read_token = (
        None if found.read_token_env is None else _token(file, "read_token_env", found.read_token_env)
    )
    drive_token = None
    if found.drive:
        if found.drive_token_env is None:
            raise ServiceError(
                f"{file}: drive = true needs drive_token_env; allowed: a variable with a token"
            )
        drive_token = _token(file, "drive_token_env", found.drive_token_env)
        if drive_token == read_token:
            raise ServiceError(f"{file}: reading and driving have the same token; allowed: two")
    service = Service(
        found.host if host is None else host,
        found.port if port is None else port,
        found.hosts,
        read_token,
        drive_token,
        None if found.fleet is None else Path(found.fleet),
    )
    if not service.is_local and read_token is None:
        allowed = f"read_token_env in {file}, or 127.0.0.1"
        raise ServiceError(
            f"host {service.host}: others can reach it, so it needs a token; allowed: {allowed}"
        )
    return service


def is_loopback(host: str) -> bool:
    """Whether an address can be reached from this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _token(file: Path, key: str, variable: str) -> str:
    value = os.environ.get(variable, "")
    if len(value) < LEAST_TOKEN:
        allowed = f"at least {LEAST_TOKEN} in that variable"
        raise ServiceError(f"{file}: {key} {variable}: has {len(value)} characters; allowed: {allowed}")
    return value
