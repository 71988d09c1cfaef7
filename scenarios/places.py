"""Where the keys of a TOML text stand, by tree-sitter, which reads on past mistakes as tomllib does not."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field

import tree_sitter
import tree_sitter_toml

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Place:
    """Line and column, both from 1; columns count characters."""

    line: int
    column: int


@dataclass
class Places:
    """Places of keys and array elements; ``twice`` maps the line of a key that came before to its path."""

    of: dict[KeyPath, Place] = field(default_factory=dict)
    twice: dict[int, KeyPath] = field(default_factory=dict)

    def nearest(self, path: KeyPath) -> Place:
        """The place of a path, or of the closest thing around it that is written down."""
        inner = next((path[:n] for n in range(len(path), 0, -1) if path[:n] in self.of), None)
        return Place(1, 1) if inner is None else self.of[inner]


def find_places(text: str) -> Places:
    """Places of all keys of a TOML text, which need not be correct."""
    return _Walk(text).places


class _Walk:
    def __init__(self, text: str) -> None:
        self.places = Places()
        self._source = text.encode()
        self._lines = self._source.split(b"\n")
        self._given: set[KeyPath] = set()
        self._elements: dict[KeyPath, int] = {}
        parser = tree_sitter.Parser(tree_sitter.Language(tree_sitter_toml.language()))
        tree = parser.parse(self._source)
        for node in tree.root_node.children:
            if node.type == "pair":
                self._pair(node, ())
            elif node.type in ("table", "table_array_element"):
                self._table(node)

    def _place(self, node: tree_sitter.Node) -> Place:
        row, column = node.start_point
        return Place(row + 1, len(self._lines[row][:column].decode(errors="replace")) + 1)

    def _text(self, node: tree_sitter.Node) -> str:
        return self._source[node.start_byte : node.end_byte].decode(errors="replace")

    def _keys(self, node: tree_sitter.Node) -> Iterator[tuple[str, Place]]:
        """The names of a dotted key, in order."""
        if node.type == "dotted_key":
            for child in node.children:
                yield from self._keys(child)
        elif node.type == "bare_key":
            yield self._text(node), self._place(node)
        elif node.type == "quoted_key":
            yield _unquoted(self._text(node)), self._place(node)

    def _note(self, base: KeyPath, key: tree_sitter.Node) -> KeyPath:
        path = base
        for name, place in self._keys(key):
            path = (*path, name)
            self.places.of.setdefault(path, place)
        return path

    def _once(self, path: KeyPath, node: tree_sitter.Node) -> None:
        if path in self._given:
            self.places.twice[self._place(node).line] = path
        self._given.add(path)

    def _table(self, node: tree_sitter.Node) -> None:
        pairs = [child for child in node.children if child.type == "pair"]
        path: KeyPath = ()
        for child in node.children:
            if child.type.endswith("_key"):
                path = self._note((), child)
        if node.type == "table_array_element":
            self._elements[path] = self._elements.get(path, -1) + 1
            path = (*path, self._elements[path])
            self.places.of[path] = self._place(node)
        self._once(path, node)
        for pair in pairs:
            self._pair(pair, path)

    def _pair(self, node: tree_sitter.Node, base: KeyPath) -> None:
        path = self._note(base, node.children[0])
        self._once(path, node)
        self._value(node.children[-1] if node.children[-1].type != "comment" else node.children[2], path)

    def _value(self, node: tree_sitter.Node, path: KeyPath) -> None:
        if node.type == "inline_table":
            for child in node.children:
                if child.type == "pair":
                    self._pair(child, path)
        elif node.type == "array":
            elements = [child for child in node.children if child.is_named and child.type != "comment"]
            for number, element in enumerate(elements):
                self.places.of[(*path, number)] = self._place(element)
                self._value(element, (*path, number))


def _unquoted(text: str) -> str:
    try:
        return next(iter(tomllib.loads(f"{text} = 0")))
    except (tomllib.TOMLDecodeError, StopIteration):
        return text
