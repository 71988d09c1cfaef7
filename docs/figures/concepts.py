"""The picture of ``docs/concepts.md``: two sites, a link, one clock, episodes.

It is kept in ``docs/pictures``, where readers of the repository see it, too; a test compares.

python docs/figures/concepts.py
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

PICTURES = Path(__file__).parents[1] / "pictures"
WIDTH, HEIGHT = 900, 510


@dataclass(frozen=True)
class Ink:
    """Colours of one scheme."""

    ground: str
    text: str
    quiet: str
    box: str
    operator: str
    link: str
    robot: str


LIGHT = Ink("#ffffff", "#212121", "#616161", "#f5f7f8", "#00695c", "#6a1b9a", "#bf360c")
DARK = Ink("#1e2129", "#eceff1", "#aab4be", "#2a2f3a", "#4db6ac", "#ce93d8", "#ff8a65")
FILES = {"concepts.svg": LIGHT, "concepts.dark.svg": DARK}

# A story in seconds of the clock, told twice: the robot acts and asks; the request crosses; a person reads, thinks and
# confirms; the answer crosses, and the robot acts on it.
ROBOT = ((0.0, 5.0, "look"), (16.0, 26.0, "walk"), (37.0, 45.0, "grasp"))
OPERATOR = ((7.5, 13.0, "decide"), (28.5, 34.0, "decide"))
DOWN = ((5.0, 7.5), (26.0, 28.5))
UP = ((13.0, 16.0), (34.0, 37.0))
LONGEST_S = 46.0
LEFT, PER_S = 130, 16.0
OPERATOR_Y, ROBOT_Y, BAR = 324, 416, 34


def text(x: float, y: float, words: str, colour: str, size: int = 14, anchor: str = "start", bold: bool = False) -> str:
    """A line of text."""
    weight = ' font-weight="600"' if bold else ""
    return f'<text x="{x:g}" y="{y:g}" fill="{colour}" font-size="{size}" text-anchor="{anchor}"{weight}>{words}</text>'


def box(x: float, y: float, width: float, height: float, fill: str, stroke: str = "none") -> str:
    """A box with round corners."""
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="8" fill="{fill}" stroke="{stroke}" '
        'stroke-width="1.5"/>'
    )


def arrow(x: float, y: float, to_x: float, to_y: float, colour: str, dashes: str = "") -> str:
    """A line with a head at its end."""
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<line x1="{x:g}" y1="{y:g}" x2="{to_x:g}" y2="{to_y:g}" stroke="{colour}" stroke-width="2"{dashed} '
        f'marker-end="url(#{colour[1:]})"/>'
    )


def rule(x: float, to_x: float, y: float, colour: str) -> str:
    """A thin level line."""
    return f'<line x1="{x:g}" y1="{y:g}" x2="{to_x:g}" y2="{y:g}" stroke="{colour}" stroke-opacity="0.35"/>'


def bar(start_s: float, end_s: float, y: float) -> str:
    """A span of time."""
    return f'<rect x="{LEFT + PER_S * start_s:g}" y="{y}" width="{PER_S * (end_s - start_s):g}" height="{BAR}" rx="4"/>'


def sites(ink: Ink) -> list[str]:
    """The upper half: who is where, and what crosses."""
    parts = [box(20, 20, 250, 172, ink.box, ink.operator), box(610, 20, 270, 172, ink.box, ink.robot)]
    parts += [text(36, 48, "control station", ink.operator, 17, bold=True)]
    left = ("people in roles: one thing at a time", "a belief: the mirror of the machine,", "and what has arrived")
    parts += [text(36, 78 + 22 * n, line, ink.text) for n, line in enumerate(left)]
    parts += [text(36, 160, "knows no robot and no world", ink.quiet, 13)]
    parts += [text(626, 48, "field site", ink.robot, 17, bold=True)]
    right = ("a state machine decides what is next", "programs order skills", "Pinocchio plans, MuJoCo decides")
    parts += [text(626, 78 + 22 * n, line, ink.text) for n, line in enumerate(right)]
    parts += [text(626, 160, "knows no operator and no link", ink.quiet, 13)]
    parts += [text(440, 48, "the link", ink.link, 17, "middle", bold=True)]
    parts += [
        text(440, 82, "commands: 64 bit/s to 4 kbit/s", ink.text, 14, "middle"),
        arrow(284, 96, 596, 96, ink.link, "9 5"),
    ]
    parts += [
        arrow(596, 134, 284, 134, ink.link, "9 5"),
        text(440, 158, "mirror, pictures, clouds: 50 kbit/s", ink.text, 14, "middle"),
    ]
    parts += [text(440, 186, "rate, delay, loss, blackouts; every byte counts", ink.quiet, 13, "middle")]
    return parts


def clock(ink: Ink) -> list[str]:
    """The lower half: one clock, and what each site does on it."""
    x = [LEFT + PER_S * t for t in (0.0, LONGEST_S)]
    parts = [text(20, 248, "one clock", ink.text, 17, bold=True)]
    parts += [
        text(118, 248, "no site sees what has not arrived; the robot is frozen between its episodes", ink.quiet, 14)
    ]
    parts += [arrow(x[0], 276, x[1] + 14, 276, ink.quiet)]
    for t in range(0, int(LONGEST_S), 10):
        at = LEFT + PER_S * t
        parts += [f'<line x1="{at:g}" y1="272" x2="{at:g}" y2="280" stroke="{ink.quiet}"/>']
        parts += [text(at, 298, f"{t} s", ink.quiet, 12, "middle")]
    parts += [text(20, OPERATOR_Y + 22, "operator", ink.operator, 14), text(20, ROBOT_Y + 22, "robot", ink.robot, 14)]
    parts += [text(20, 392, "messages", ink.link, 14)]
    for y, bars, colour in ((OPERATOR_Y, OPERATOR, ink.operator), (ROBOT_Y, ROBOT, ink.robot)):
        parts += [rule(x[0], x[1], y + BAR / 2, colour)]
        for start, end, words in bars:
            parts += [f'<g fill="{colour}">{bar(start, end, y)}</g>']
            parts += [text(LEFT + PER_S * (start + end) / 2, y + 22, words, ink.ground, 14, "middle", bold=True)]
    top, bottom = OPERATOR_Y + BAR + 3, ROBOT_Y - 4
    parts += [arrow(LEFT + PER_S * a, bottom, LEFT + PER_S * b, top, ink.link) for a, b in DOWN]
    parts += [arrow(LEFT + PER_S * a, top, LEFT + PER_S * b, bottom, ink.link) for a, b in UP]
    parts += [text(LEFT, 488, "everything that happens is a record in one MCAP file a run", ink.quiet, 14)]
    return parts


def picture(ink: Ink) -> str:
    """The whole picture as SVG."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="Helvetica, Arial, sans-serif" role="img">'
        "<title>Two sites, a link that carries messages, one clock</title>"
    )
    heads = "".join(
        f'<marker id="{colour[1:]}" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="7" markerHeight="7" '
        f'orient="auto"><path d="M0 0L10 5L0 10z" fill="{colour}"/></marker>'
        for colour in (ink.link, ink.quiet)
    )
    return "\n".join(
        [head, f"<defs>{heads}</defs>", box(0, 0, WIDTH, HEIGHT, ink.ground), *sites(ink), *clock(ink), "</svg>", ""]
    )


def main() -> None:
    """Write the picture for both schemes."""
    for name, ink in FILES.items():
        (PICTURES / name).write_text(picture(ink), encoding="utf-8")


if __name__ == "__main__":
    main()
