"""Draws our own pictures' SVG with Pillow: the few forms that they are made of."""

import base64
import re
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from lxml import etree
from PIL import Image, ImageDraw, ImageFont

# Every pixel is the mean of so many squared.
FINER = 2

_COMMAND = re.compile(r"([a-zA-Z])([^a-zA-Z]*)")
_NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)")
_MOVED = re.compile(r"translate\(([-\d.]+) ([-\d.]+)\)")
# Letters that Pillow's own font has not.
_IN_THE_FONT = str.maketrans({"–": "-", "↑": "^", "…": ".", "²": "2", "³": "3"})
# What these mean in the order of x and y.
_ALONG = {"h": (1.0, 0.0), "v": (0.0, 1.0)}

Style = dict[str, str]
Styles = Mapping[str, Mapping[str, str]]
Point = tuple[float, float]


def rasterised(svg: str, styles: Styles, width: int, height: int) -> bytes:
    """A PNG of an SVG that `picture_svg` made.

    Args:
        svg: The picture.
        styles: How its classes are drawn.
        width: [px].
        height: [px].
    """
    root = etree.fromstring(svg.encode(), etree.XMLParser(huge_tree=True))
    box = [float(v) for v in root.get("viewBox").split()]
    scale = FINER * min(width / box[2], height / box[3])
    image = Image.new("RGB", (FINER * width, FINER * height), "white")
    middle = (
        (FINER * width / scale - box[2]) / 2.0,
        (FINER * height / scale - box[3]) / 2.0,
    )
    canvas = _Canvas(image, styles, scale, "still" in root.get("class"))
    canvas.group(root, middle, {})
    out = BytesIO()
    image.resize((width, height), Image.Resampling.BOX).save(out, "PNG")
    return out.getvalue()


class _Canvas:
    """An image, the scale of what is drawn on it, and how classes are drawn."""

    def __init__(
        self, image: Image.Image, styles: Styles, scale: float, still: bool
    ) -> None:
        self._picture, self._styles, self._scale = image, styles, scale
        self._pen = ImageDraw.Draw(image)
        self._letters = 22.0 if still else 12.0

    def group(self, element: Any, at: Point, style: Style) -> None:
        """Draws what is in an element, moved by `at`."""
        draw = {
            **{"g": self.group, "line": self._line, "polyline": self._line},
            **{"polygon": self._polygon, "circle": self._circle, "rect": self._rect},
            **{"path": self._path, "text": self._text, "image": self._image},
        }
        if element.get("clip-path"):
            self._clipped(element, at, style)
            return
        for child in element:
            form = draw.get(etree.QName(child).localname)
            if form is not None:
                moved = _MOVED.match(child.get("transform", ""))
                x, y = map(float, moved.groups()) if moved else (0.0, 0.0)
                form(child, (at[0] + x, at[1] + y), self._drawn(child, style))

    def _clipped(self, element: Any, at: Point, style: Style) -> None:
        """Draws beside, and takes over what lies within the rectangle."""
        rect = element.getprevious()[0]
        beside = _Canvas(self._picture.copy(), self._styles, self._scale, False)
        inner = etree.Element("g")
        inner.extend(list(element))
        beside.group(inner, at, style)
        x, y, w, h = (float(rect.get(k)) for k in ("x", "y", "width", "height"))
        left, top = (round(v) for v in self._px(x, y, at))
        right, bottom = (round(v) for v in self._px(x + w, y + h, at))
        piece = beside._picture.crop((left, top, right, bottom))
        self._picture.paste(piece, (left, top))

    def _drawn(self, element: Any, style: Style) -> Style:
        found = dict(style)
        for name in element.get("class", "").split():
            found |= self._styles.get(name, {})
        return found

    def _px(self, x: float, y: float, at: Point) -> Point:
        return self._scale * (x + at[0]), self._scale * (y + at[1])

    def _stroke(self, points: Sequence[Point], style: Style) -> None:
        colour = style.get("stroke", "none")
        if colour == "none" or len(points) < 2:
            return
        wide = max(1, round(self._scale * float(style.get("stroke-width", 1.5))))
        dashes = [
            self._scale * float(v) for v in style.get("stroke-dasharray", "").split()
        ]
        for piece in _pieces(points, dashes):
            self._pen.line(piece, fill=colour, width=wide, joint="curve")

    def _line(self, element: Any, at: Point, style: Style) -> None:
        if element.get("points"):
            numbers = [float(v) for v in _NUMBER.findall(element.get("points"))]
        else:
            numbers = [float(element.get(k)) for k in ("x1", "y1", "x2", "y2")]
        pairs = zip(numbers[::2], numbers[1::2], strict=True)
        self._stroke([self._px(x, y, at) for x, y in pairs], style)

    def _polygon(self, element: Any, at: Point, style: Style) -> None:
        numbers = [float(v) for v in _NUMBER.findall(element.get("points"))]
        pairs = zip(numbers[::2], numbers[1::2], strict=True)
        self._pen.polygon([self._px(x, y, at) for x, y in pairs], fill=style["fill"])

    def _circle(self, element: Any, at: Point, style: Style) -> None:
        x, y, r = (float(element.get(k)) for k in ("cx", "cy", "r"))
        box = [*self._px(x - r, y - r, at), *self._px(x + r, y + r, at)]
        wide = round(self._scale * float(style.get("stroke-width", 1.0)))
        self._pen.ellipse(box, style.get("fill"), style.get("stroke"), wide)

    def _rect(self, element: Any, at: Point, style: Style) -> None:
        x, y, w, h = (float(element.get(k, 0)) for k in ("x", "y", "width", "height"))
        box = [*self._px(x, y, at), *self._px(x + w, y + h, at)]
        round_by = self._scale * float(element.get("rx", 0))
        self._pen.rounded_rectangle(box, round_by, fill=style.get("fill"))

    def _path(self, element: Any, at: Point, style: Style) -> None:
        inner = element.get("class", "")
        colour = style.get("stroke", "none")
        for line in _subpaths(element.get("d")):
            points = [self._px(x, y, at) for x, y in line]
            if inner == "fill":
                self._pen.polygon(points, fill=style["fill"])
            else:
                self._stroke(points, {**style, "stroke": colour})

    def _text(self, element: Any, at: Point, style: Style) -> None:
        if not element.text:
            return
        size = self._scale * float(style.get("font-size", self._letters))
        font = ImageFont.load_default(size if self._letters < 20 else 22 * self._scale)
        x, y = self._px(float(element.get("x", 0)), float(element.get("y", 0)), at)
        anchor = {"end": "rs", "middle": "ms"}.get(element.get("text-anchor", ""), "ls")
        words = element.text.translate(_IN_THE_FONT)
        if element.get("transform"):
            self._aside(words, font, at)
            return
        chip = "chip" in element.getparent().get("class", "")
        named = "name" in element.get("class", "").split() and self._letters > 20
        colour = (
            "#ffffff" if chip else "#003c96" if named else style.get("fill", "#1b1f24")
        )
        halo = round(2 * self._scale) if named else 0
        self._pen.text(
            (x, y),
            words,
            colour,
            font,
            anchor,
            stroke_width=halo,
            stroke_fill="#ffffff",
        )

    def _aside(self, words: str, font: Any, at: Point) -> None:
        """The name of the axis at the left, from below to above."""
        left, top, right, bottom = (round(v) for v in font.getbbox(words))
        label = Image.new("RGB", (right - left, bottom - top), "white")
        ImageDraw.Draw(label).text((-left, -top), words, "#5a6370", font)
        turned = label.rotate(90, expand=True)
        x, y = self._px(-12.0, 0.0, at)
        self._picture.paste(turned, (round(x), round(y - turned.height / 2)))

    def _image(self, element: Any, at: Point, _: Style) -> None:
        data = base64.b64decode(element.get("href").split(",", 1)[1])
        w, h = (round(self._scale * float(element.get(k))) for k in ("width", "height"))
        left, top = (round(v) for v in self._px(0.0, 0.0, at))
        self._picture.paste(Image.open(BytesIO(data)).resize((w, h)), (left, top))


def _subpaths(d: str) -> list[list[Point]]:
    """The lines of a path of M, l, h, v, z, and circles of two arcs."""
    lines: list[list[Point]] = []
    at = np.zeros(2)
    for letter, rest in _COMMAND.findall(d):
        numbers = [float(v) for v in _NUMBER.findall(rest)]
        if letter in "aA":
            turns = np.linspace(-np.pi / 2, 1.5 * np.pi, 33)
            middle, r = at + (0.0, numbers[0]), numbers[0]
            lines[-1] += [
                (middle[0] + r * np.cos(t), middle[1] + r * np.sin(t)) for t in turns
            ]
        elif letter in "zZ":
            lines[-1].append(lines[-1][0])
        else:
            for k, step in enumerate(_steps(letter, numbers, at)):
                at = step(at)
                if letter in "mM" and k == 0:
                    lines.append([])
                lines[-1].append((float(at[0]), float(at[1])))
    return lines


def _steps(letter: str, numbers: Sequence[float], at: Any) -> list[Any]:
    """What each point of a command does to the place before it."""
    if letter.lower() in _ALONG:
        along = np.array(_ALONG[letter.lower()])
        if letter.islower():
            return [lambda p, n=n: p + n * along for n in numbers]
        return [lambda p, n=n: p * (1.0 - along) + n * along for n in numbers]
    pairs = [np.array(pair) for pair in zip(numbers[::2], numbers[1::2], strict=True)]
    if letter.islower():
        return [lambda p, step=step: p + step for step in pairs]
    return [lambda _, step=step: step for step in pairs]


def _pieces(points: Sequence[Point], dashes: Sequence[float]) -> list[list[Point]]:
    """A line as its dashes; one piece if it has none."""
    if not dashes:
        return [list(points)]
    corners = np.array(points)
    lengths = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]
    found, at, k = [], 0.0, 0
    while at < lengths[-1]:
        end = min(at + dashes[k % len(dashes)], lengths[-1])
        if k % 2 == 0:
            inner = lengths[(lengths > at) & (lengths < end)]
            where = np.r_[at, inner, end]
            xs, ys = (np.interp(where, lengths, corners[:, i]) for i in (0, 1))
            found.append(list(zip(xs.tolist(), ys.tolist(), strict=True)))
        at, k = end, k + 1
    return found
