"""DOT's words: attributes, quoting, the legend of a machine's picture."""

from __future__ import annotations

from types import MappingProxyType
from xml.sax.saxutils import escape

from teleop_sim.machines.elements import INHERIT, Autonomy, Edge

COLOURS = MappingProxyType(
    {
        INHERIT: "#000000",
        Autonomy.OFF: "#7f7f7f",
        Autonomy.LOW: "#0072b2",
        Autonomy.HIGH: "#009e73",
        Autonomy.FULL: "#d55e00",
    }
)
"""Of a line by its threshold."""

_WHEN = MappingProxyType(
    {
        Autonomy.OFF: "passes by itself at level low and above",
        Autonomy.LOW: "passes by itself at level high and full",
        Autonomy.HIGH: "passes by itself at level full only",
        Autonomy.FULL: "always waits for a person",
        INHERIT: "always passes: still at work, or guarded inside",
    }
)


class Html(str):
    """A label in Graphviz's HTML: it is not quoted."""

    __slots__ = ()


def attributes(subject: str, **given: str) -> str:
    """One DOT statement: a node, an edge or a default with its attributes."""
    listed = ", ".join(f"{key}={value if isinstance(value, Html) else quoted(value)}" for key, value in given.items())
    return f"{subject} [{listed}];"


def quoted(text: str) -> str:
    r"""A DOT string; a line's end becomes ``\n``, and nothing in it is read as an escape or an entity of HTML."""
    plain = "\n".join(map(_drawable, text.split("\n"))).replace("&", "&amp;")
    plain = plain.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{plain}"'


def state_label(name: str, notes: tuple[str, ...], inside: tuple[Edge, ...], level: int | None) -> Html:
    """A state's name, remarks, and those of its outcomes that are written into it."""
    lines = [html(name), *(f'<font point-size="9">({note})</font>' for note in notes)]
    for edge in inside:
        leads = "\u21bb" if edge.next_state == edge.state else f"\u2192 {edge.next_state.rpartition('/')[2]}:"
        text = html(f"{leads} {edge.event}{' (operator)' if edge.raised_by == 'operator' else ''}")
        waits = level is not None and not edge.passes(level)
        colour = COLOURS[edge.threshold]
        lines.append(f'<font point-size="9" color="{colour}">{f"<i>{text}</i>" if waits else text}</font>')
    return Html(f"<{'<br/>'.join(lines)}>")


def html(text: str) -> str:
    """Text in a label of Graphviz's HTML."""
    return escape(_drawable(text), {'"': "&quot;"})


def _drawable(text: str) -> str:
    """With ``?`` for what XML 1.0, and so SVG, cannot hold (its production 2, Char)."""
    return "".join("?" if c < " " or "\ud800" <= c <= "\udfff" or c in "\ufffe\uffff" else c for c in text)


def legend(name: str, level: int | None) -> Html:
    """HTML-like label: the machine's name, what colours and kinds of lines mean."""
    rows = [f'<tr><td colspan="3" align="left"><b>{html(name)}</b></td></tr>']
    for threshold, colour in sorted(COLOURS.items(), key=lambda item: (item[0] == INHERIT, item[0])):
        called = "inherit" if threshold == INHERIT else Autonomy(threshold).name.lower()
        rows.append(
            f'<tr><td width="36" height="4" bgcolor="{colour}"></td>'
            f'<td align="left"><font color="{colour}"><b>{called}</b></font></td>'
            f'<td align="left">{_WHEN[threshold]}</td></tr>'
        )
    notes = [
        "bold frame: begins here",
        "dashed frame: all inside at once",
        "dotted line: only an operator raises it",
        "\u21bb: begins the state anew; \u2192: leads to that state",
        "pointed box: leads to the state of that name",
    ]
    if level is not None:
        notes.append(f"dashed line, slanted text: waits for a person at level {Autonomy(level).name.lower()}")
    rows += [f'<tr><td colspan="3" align="left"><font point-size="9">{note}</font></td></tr>' for note in notes]
    return Html(f'<<table border="0" cellspacing="2" cellpadding="1">{"".join(rows)}</table>>')
