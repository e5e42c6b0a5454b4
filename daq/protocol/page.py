"""The commissioning protocol as one HTML file; printed it is one page of A4."""

from __future__ import annotations

from daq.protocol.content import Protocol
from daq.report.pictures import icon
from daq.report.templates import templates

SIGNATURES = ("Commissioned by", "Approved by")
"""Who signs."""


def render_protocol(protocol: Protocol) -> str:
    """The page as text; it needs no other file and no network."""
    page = templates().get_template("protocol.html.j2")
    return page.render(
        protocol=protocol, icon=icon("good" if protocol.commissioned else "bad"), signatures=SIGNATURES
    )
