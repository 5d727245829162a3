"""Small pieces of reStructuredText."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import indent


def title(text: str, line: str = "=") -> str:
    """A heading."""
    return f"{text}\n{line * len(text)}\n"


def directive(name: str, argument: str = "", body: str = "", **options: str) -> str:
    """A directive with its options and its body."""
    head = [f".. {name}:: {argument}".rstrip()]
    head += [f"   :{key.replace('_', '-')}: {value}".rstrip() for key, value in options.items()]
    return "\n".join([*head, "", indent(body, "   "), ""])


def toctree(names: Iterable[str], **options: str) -> str:
    """Pages below this one."""
    return directive("toctree", body="\n".join(names), **options)


def code(text: str, language: str = "text") -> str:
    """Text as it is."""
    return directive("code-block", language, text.rstrip())
