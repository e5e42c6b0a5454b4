"""What the set-up finds at a drive, by severity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["refusal", "warning", "info"]
"""``refusal``: the arm must not be enabled so; ``warning``: it may, but
somebody should know; ``info``: a fact."""


@dataclass(frozen=True)
class Finding:
    """One thing worth telling.

    Attributes:
        severity: how much it matters.
        subject: the object or key that it is about, such as ``6065`` or ``identity``.
        text: in words, with the values found and expected.
    """

    severity: Severity
    subject: str
    text: str

    def __str__(self) -> str:
        return f"{self.subject}: {self.text}"
