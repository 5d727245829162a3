"""Tables of methods, models and formats.

Entries with code of their own are files of a folder, whose record is the entry: a new entry is a
new file, and the names are those of the files, so that a help text can show them without importing
what they need. Entries that differ in a word are the lines of one module (`RecordTable`). Standard
library only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Generic, TypeVar

from armimpedance.core.errors import InputError

Entry = TypeVar("Entry")


class EntryTable(Mapping[str, Entry], Generic[Entry]):
    """Entries by their names; the default first, the others by the alphabet.

    `kind`: what an entry is called in messages, such as "method".
    `default`: the name of the entry that is meant where none is named; "" if there is none.
    """

    def __init__(self, kind: str, default: str = "") -> None:
        self.kind: str = kind
        self.default: str = default
        self._loaded: dict[str, Entry] = {}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All names; no entry is imported for them."""
        return tuple(sorted(self._listed(), key=lambda name: (name != self.default, name)))

    def _listed(self) -> Iterable[str]:
        """The names in any order."""
        return self._loaded

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, name: str) -> Entry:
        return self._loaded[name]

    def named(self, name: str | None = None) -> Entry:
        """Look up an entry; None means the default.

        Raises InputError: there is none of that name; the message lists those that there are.
        """
        wanted = self.default if name is None else name
        if wanted not in self.names:
            raise InputError(
                f"unknown {self.kind} {wanted!r}", expected=f"one of {', '.join(self.names)}"
            )
        return self[wanted]

    def listed(self) -> str:
        """The names as a help text shows them: ``weighted (default), exact, ...``."""
        return ", ".join(n + (" (default)" if n == self.default else "") for n in self.names)


class RecordTable(EntryTable[Entry]):
    """A table whose entries are a word or a few lines each: its module lists them itself.

    `entries`: by their names; what they need is imported where it is used.
    """

    def __init__(self, entries: Mapping[str, Entry], kind: str, default: str = "") -> None:
        super().__init__(kind, default)
        self._loaded.update(entries)


class MethodTable(EntryTable[Entry]):
    """The entries of a folder, each imported when it is looked up.

    `package`: the folder, dotted. Each of its modules holds one entry.
    `record`: what the entry is called in its module, such as ``METHOD``.
    `joint`: what stands in names where the file's name has an underscore.
    """

    def __init__(
        self, package: str, record: str, kind: str, default: str = "", joint: str = "_"
    ) -> None:
        super().__init__(kind, default)
        self._package, self._record, self._joint = package, record, joint

    def _listed(self) -> Iterable[str]:
        folder = import_module(self._package)
        found = (module.name for module in iter_modules(folder.__path__))
        return (name.replace("_", self._joint) for name in found)

    def _place(self, name: str) -> str:
        """The module that holds an entry."""
        return f"{self._package}.{name.replace(self._joint, '_')}"

    def __getitem__(self, name: str) -> Entry:
        if name not in self._loaded:
            if name not in self.names:
                raise KeyError(name)
            module = import_module(self._place(name))
            self._loaded[name] = getattr(module, self._record)
        return self._loaded[name]


class FoundTable(MethodTable[Entry]):
    """A table whose entries stand in many folders: each topic holds its own.

    `package`: the package that is looked through, with all its folders.
    `ending`: how the names of the modules end: ``elbow_page`` is the entry ``elbow`` of "_page".
    `record`, `kind`, `default`: as of `MethodTable`.
    """

    def __init__(
        self, package: str, ending: str, record: str, kind: str, default: str = ""
    ) -> None:
        super().__init__(package, record, kind, default)
        self._ending = ending

    @cached_property
    def _places(self) -> dict[str, str]:
        """Name of an entry -> the module that holds it, dotted."""
        root = Path(str(import_module(self._package).__file__)).parent
        found = {}
        for path in root.rglob(f"*{self._ending}.py"):
            parts = path.relative_to(root).with_suffix("").parts
            found[path.stem.removesuffix(self._ending)] = ".".join((self._package, *parts))
        return found

    def _listed(self) -> Iterable[str]:
        return self._places

    def _place(self, name: str) -> str:
        return self._places[name]
