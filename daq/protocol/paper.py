"""The commissioning protocol as one page: one HTML file that prints on A4, or a PDF, A4 across."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import astuple
from functools import lru_cache
from io import BytesIO
from typing import TYPE_CHECKING

from daq.protocol.content import Protocol, ProtocolError
from daq.report.pictures import icon
from daq.report.templates import templates
from daq.text.numbers import NOTHING
from robots.extras import install_command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT, MARGIN = 297.0, 210.0, 12.0
"""mm, of the sheet."""

_SIZES = (8.5, 8.0, 7.5, 7.0, 6.5, 6.0, 5.5, 5.0)
"""pt; the largest with which everything is on the page."""

_LEADING = 1.3
_MM = 25.4 / 72.0
"""mm of a point."""

_JOINTS = (
    ("Joint", 1.3),
    ("Node", 0.6),
    ("Serial number", 1.4),
    ("Position", 1.9),
    ("Velocity", 1.2),
    ("Acceleration", 1.3),
    ("Torque", 1.0),
    ("Highest speed", 1.4),
    ("Highest torque", 1.4),
    ("Following error", 1.2),
)
"""Headings with the shares of the width."""
_STAGES = (
    ("Stage", 1.0),
    ("State", 0.7),
    ("Run", 0.5),
    ("When", 1.7),
    ("By", 0.9),
    ("What", 5.6),
    ("Cycles", 1.4),
    ("Recording, SHA-256", 1.3),
)


def pdf_of(protocol: Protocol) -> bytes:
    """The page as a PDF file.

    Raises:
        ProtocolError: matplotlib is not installed, or not everything has room on one page.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError:
        raise ProtocolError(
            f"PDF needs matplotlib; install it with: {install_command('pdf')}, or take --out FILE.html and"
            " print that: it is one page, too"
        ) from None

    logging.getLogger("fontTools").setLevel(logging.WARNING)  # it tells of each table of each font
    # Type 42 keeps letters as text, which can be searched and copied.
    with rc_context({"pdf.fonttype": 42, "font.family": ["DejaVu Sans"]}):
        for size in _SIZES:
            figure = Figure(figsize=(WIDTH / 25.4, HEIGHT / 25.4))
            if _Sheet(figure, size).drawn(protocol):
                target = BytesIO()
                title = f"Commissioning protocol: {protocol.arm}"
                figure.savefig(target, format="pdf", metadata={"Title": title, "CreationDate": None})
                return target.getvalue()
    raise ProtocolError(
        f"arm {protocol.arm}: {len(protocol.joints)} joints and {len(protocol.remarks)} remarks have no room"
        " on one page of PDF; take --out FILE.html"
    )


class _Sheet:
    """Fills one page from the top; all lengths are mm, sizes of letters pt."""

    def __init__(self, figure: Figure, size: float) -> None:
        self._figure = figure
        self._size = size
        self._y = MARGIN

    def drawn(self, protocol: Protocol) -> bool:
        """Draw everything; whether it had room."""
        self._line(f"Commissioning protocol: {protocol.arm}", 1.7, bold=True)
        where = ", on simulated drives" if protocol.simulated else ""
        colour = "#006b4d" if protocol.commissioned else "#a83c00"
        self._line(f"{protocol.verdict}{where}.", 1.25, bold=True, colour=colour)
        self._y += 1.5
        half = (len(protocol.facts) + 1) // 2
        pairs = [
            (*left, *right)
            for left, right in zip(protocol.facts[:half], [*protocol.facts[half:], ("", "")], strict=False)
        ]
        self._table((("", 0.8), ("", 4.2), ("", 0.8), ("", 4.2)), pairs)
        reached = f", and what was reached in the {protocol.figures_of}" if protocol.figures_of else ""
        self._heading(f"Joints: drives, limits{reached}")
        self._table(_JOINTS, [astuple(row) for row in protocol.joints])
        self._heading("Stages")
        self._table(_STAGES, [astuple(row) for row in protocol.stages])
        if protocol.remarks:
            self._heading("Remarks")
            for remark in protocol.remarks:
                self._table((("", 1.0),), [(remark,)])
        self._signatures()
        self._y += 2.0
        self._line(protocol.made, 0.9, colour="#58636d")
        return self._y <= HEIGHT - MARGIN / 2

    def _heading(self, text: str) -> None:
        self._y += 2.0
        self._line(text, 1.2, bold=True)

    def _line(self, text: str, times: float, *, bold: bool = False, colour: str = "black") -> None:
        size = times * self._size
        self._y += _LEADING * size * _MM
        self._text(MARGIN, text, size, bold=bold, colour=colour)

    def _text(self, x: float, text: str, size: float, *, bold: bool = False, colour: str = "black") -> None:
        self._figure.text(
            x / WIDTH,
            1.0 - self._y / HEIGHT,
            text,
            fontsize=size,
            fontweight="bold" if bold else "normal",
            color=colour,
            verticalalignment="baseline",
            parse_math=False,  # a dollar sign in a note is one
        )

    def _rule(self, start: float, end: float) -> None:
        from matplotlib.lines import Line2D

        height = 1.0 - self._y / HEIGHT
        self._figure.add_artist(
            Line2D([start / WIDTH, end / WIDTH], [height, height], linewidth=0.5, color="black")
        )

    def _table(self, columns: Sequence[tuple[str, float]], rows: Sequence[Sequence[object]]) -> None:
        """Rows of cells that wrap in their columns, under headings where there are any."""
        shares = [share for _, share in columns]
        unit = (WIDTH - 2 * MARGIN) / sum(shares)
        edges = [MARGIN + unit * sum(shares[:k]) for k in range(len(shares))]
        widths = [unit * share - 1.5 for share in shares]
        headings = [heading for heading, _ in columns]
        if any(headings):
            self._row(edges, widths, headings, bold=True)
            self._y += 0.8
            self._rule(MARGIN, WIDTH - MARGIN)
        for row in rows:
            self._row(edges, widths, [NOTHING if cell is None else str(cell) for cell in row])

    def _row(
        self, edges: Sequence[float], widths: Sequence[float], cells: Sequence[str], *, bold: bool = False
    ) -> None:
        wrapped = [
            _wrapped(cell, width, self._size, bold=bold) for cell, width in zip(cells, widths, strict=True)
        ]
        for number in range(max(map(len, wrapped))):
            self._y += _LEADING * self._size * _MM
            for edge, lines in zip(edges, wrapped, strict=True):
                if number < len(lines):
                    self._text(edge, lines[number], self._size, bold=bold)

    def _signatures(self) -> None:
        self._y += 14.0
        each = (WIDTH - 2 * MARGIN) / len(SIGNATURES)
        for number in range(len(SIGNATURES)):
            start = MARGIN + number * each
            self._rule(start, start + each - 10.0)
        self._y += _LEADING * self._size * _MM
        for number, who in enumerate(SIGNATURES):
            self._text(MARGIN + number * each, f"{who}: name, date, signature", self._size)


def _wrapped(text: str, width: float, size: float, *, bold: bool) -> list[str]:
    """Lines of a text that are at most so wide, mm; a word that is wider is cut."""
    lines = [""]
    for word in text.split(" "):
        rest = word
        tried = f"{lines[-1]} {rest}" if lines[-1] else rest
        if _wide(tried, size, bold) <= width:
            lines[-1] = tried
            continue
        if lines[-1]:
            lines.append("")
        while _wide(rest, size, bold) > width and len(rest) > 1:
            fits = next(
                n for n in range(len(rest) - 1, 0, -1) if n == 1 or _wide(rest[:n], size, bold) <= width
            )
            lines[-1] = rest[:fits]
            lines.append("")
            rest = rest[fits:]
        lines[-1] = rest
    return lines


def _wide(text: str, size: float, bold: bool) -> float:
    """Width of a text, mm."""
    return _wide_in_points(text, bold) * size * _MM


@lru_cache(maxsize=4096)
def _wide_in_points(text: str, bold: bool) -> float:
    """Width of a text in letters of 1 pt, pt."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=100.0, weight="bold" if bold else "normal")
    width, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return float(width) / 100.0


SIGNATURES = ("Commissioned by", "Approved by")
"""Who signs."""


def render_protocol(protocol: Protocol) -> str:
    """The page as text; it needs no other file and no network."""
    page = templates().get_template("protocol.html.j2")
    return page.render(
        protocol=protocol, icon=icon("good" if protocol.commissioned else "bad"), signatures=SIGNATURES
    )
