"""What notebooks show: tables, curves and images as HTML, readable on light and on dark backgrounds.

Colours of text and lines are those of the page; all text is escaped. The standard library suffices, except for images.
"""

from __future__ import annotations

import html
import math
import struct
import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._typing import Float32Array

# Of Okabe and Ito (2008), the blue lighter: each differs from white and from black.
COLOURS = ("#1f83c9", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
LARGEST_IMAGE = 240  # px
WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 460, 230, 58, 36, 10, 8


@dataclass
class Series:
    """A curve: values over steps, None where unknown, with the ends of a band where there is one."""

    name: str
    steps: list[int]
    values: list[float | None]
    low: list[float | None] = field(default_factory=list)
    high: list[float | None] = field(default_factory=list)


def block(title: str, *parts: str) -> str:
    """A titled piece of a page."""
    return (f'<div style="font:13px/1.4 sans-serif;color:inherit;max-width:48em"><strong>{html.escape(title)}</strong>'
            + "".join(parts) + "</div>")


def paragraph(text: str) -> str:
    """Plain text."""
    return f'<p style="margin:.5em 0 .2em">{html.escape(text)}</p>'


def number(value: float | None) -> str:
    """Three digits, or a dash where the value is unknown."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.3g}"


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table; text is escaped."""
    def line(cells: Sequence[Any], tag: str) -> str:
        style = "padding:1px 10px 1px 0;text-align:left;background:none;border:0;color:inherit"
        return "<tr>" + "".join(f'<{tag} style="{style}">{html.escape(str(cell))}</{tag}>' for cell in cells) + "</tr>"

    top = f"<thead>{line(head, 'th')}</thead>" if head else ""
    return ('<table style="border-collapse:collapse;margin:.3em 0;font:inherit;color:inherit">' + top
            + "<tbody>" + "".join(line(row, "td") for row in rows) + "</tbody></table>")


def images(named: Sequence[tuple[str, Float32Array]], white: float | None = None) -> str:
    """Images side by side, in greys, each with its caption.

    Args:
        named: Captions and images, shape (height, width), in a scene's units.
        white: Value that is shown as white; None: the largest of the first image but for a few pixels.
    """
    import numpy as np

    if white is None:
        white = float(np.quantile(named[0][1], 0.998))
    figures = []
    for caption, image in named:
        step = -(-max(image.shape) // LARGEST_IMAGE)
        grey = np.clip(image[::step, ::step] / (white or 1) * 255, 0, 255).astype(np.uint8)
        figures.append(f'<figure style="margin:0 10px 4px 0;display:inline-block"><img alt="{html.escape(caption)}" '
                       f'width="{grey.shape[1]}" style="min-width:120px;image-rendering:pixelated" src="{_png(grey)}"/>'
                       f"<figcaption>{html.escape(caption)}</figcaption></figure>")
    return f'<div style="margin:.4em 0">{"".join(figures)}</div>'


def _png(grey: Any) -> str:
    """An 8-bit image, shape (height, width), as a data URI (PNG, third edition: https://www.w3.org/TR/png-3)."""
    import base64

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    height, width = grey.shape
    lines = b"".join(b"\0" + grey[row].tobytes() for row in range(height))
    data = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(lines, 9)) + chunk(b"IEND", b""))
    return "data:image/png;base64," + base64.b64encode(data).decode()


def chart(series: Sequence[Series], across: str, up: str) -> str:
    """Curves with their bands as an SVG image; the vertical axis is logarithmic."""
    known = [value for one in series for part in (one.values, one.low, one.high) for value in part if value and value > 0]
    if not known:
        return ""
    low, high = math.log10(min(known)), math.log10(max(known))
    low, high = (low - 0.5, high + 0.5) if high - low < 0.1 else (low - 0.05 * (high - low), high + 0.05 * (high - low))
    last = max(1, *(step for one in series for step in one.steps))

    def point(step: float, value: float) -> str:
        share = (math.log10(max(value, 10**low)) - low) / (high - low)
        return f"{LEFT + step / last * (WIDTH - LEFT - RIGHT):.1f},{HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM):.1f}"

    parts = _axes(low, high, last, point, across, up)
    for place, one in enumerate(series):
        colour = COLOURS[place % len(COLOURS)]
        band = [(step, a, b) for step, a, b in zip(one.steps, one.low, one.high) if a is not None and b is not None]
        if band:
            around = [point(step, b) for step, _, b in band] + [point(step, a) for step, a, _ in reversed(band)]
            parts.append(f'<polygon points="{" ".join(around)}" fill="{colour}" fill-opacity=".2"/>')
        line = [point(step, value) for step, value in zip(one.steps, one.values) if value is not None]
        dash = ' stroke-dasharray="5 3"' if place >= len(COLOURS) else ""
        parts.append(f'<polyline points="{" ".join(line)}" fill="none" stroke="{colour}" stroke-width="1.8"{dash}/>')
    keys = "".join(f'<span style="white-space:nowrap;margin-right:1em"><span style="color:{COLOURS[place % len(COLOURS)]}">'
                   f'{"━" if place < len(COLOURS) else "╍"}</span> {html.escape(one.name)}</span>'
                   for place, one in enumerate(series))
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    return (f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{html.escape(up)}" style="display:block;'
            f'max-width:100%" font-size="11" font-family="sans-serif">{"".join(parts)}</svg><div>{keys}</div>')


def _axes(low: float, high: float, last: int, point: Any, across: str, up: str) -> list[str]:
    parts = ['<g fill="currentColor" stroke="none">']
    marks = [(10.0**power * factor, factor == 1) for power in range(math.floor(low), math.ceil(high) + 1)
             for factor in (1, 2, 5)]
    lines = []
    for value, decade in marks:
        if not low <= math.log10(value) <= high or not (decade or high - low < 2.2):
            continue
        end = point(last, value)
        y = end.split(",")[1]
        lines.append(f'<path d="M{point(0, value)} L{end}"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{float(y) + 4:.1f}" text-anchor="end">{value:g}</text>')
    spacing = max(1, next(size for size in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 10**6) if last / size <= 6))
    for step in range(0, last + 1, spacing):
        x = point(step, 10**low).split(",")[0]
        parts.append(f'<text x="{x}" y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{step}</text>')
    middle = (HEIGHT - BOTTOM + TOP) / 2
    parts.append(f'<text x="{(WIDTH + LEFT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">{html.escape(across)}</text>'
                 f'<text transform="translate(11 {middle}) rotate(-90)" text-anchor="middle">{html.escape(up)}</text></g>')
    frame = f'<path d="M{point(0, 10**high)} L{point(0, 10**low)} L{point(last, 10**low)}" stroke-opacity=".8"/>'
    return [f'<g fill="none" stroke="currentColor" stroke-opacity=".2">{"".join(lines)}{frame}</g>', *parts]
