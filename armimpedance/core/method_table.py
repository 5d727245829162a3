"""Tables of methods, models and formats.

An entry with its own code is a module in a folder, and a record in the module is the entry. A new
entry is a new file, and the names are those of the files, so that a help text can list them without
importing the modules. Short entries are listed together in one module (`RecordTable`). Standard
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
    """Entries by their names: the default first, the others in alphabetical order.

    `kind`: what an entry is called in messages, such as "method".
    `default`: name of the entry that is used if no name is stated; "" if there is no default.
    """

    def __init__(self, kind: str, default: str = "") -> None:
        self.kind: str = kind
        self.default: str = default
        self._loaded: dict[str, Entry] = {}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All names; no entry is imported."""
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

        Raises InputError: there is no entry of that name; the message lists all names.
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
    """A table of short entries, which its module lists itself.

    `entries`: by their names; they import packages only where they use them.
    """

    def __init__(self, entries: Mapping[str, Entry], kind: str, default: str = "") -> None:
        super().__init__(kind, default)
        self._loaded.update(entries)


class MethodTable(EntryTable[Entry]):
    """The entries of a folder, each imported when it is looked up.

    `package`: the folder, dotted. Each of its modules holds one entry.
    `record`: what the entry is called in its module, such as ``METHOD``.
    `joint`: replaces the underscores of the file's name in the entry's name.
    """

    def __init__(
        self, package: str, record: str, kind: str, default: str = "", joint: str = "_"
    ) -> None:
        super().__init__(kind, default)
        self._package, self._record, self._joint = package, record, joint

    def _listed(self) -> Iterable[str]:
        folder = import_module(self._package)
        modules = (module.name for module in iter_modules(folder.__path__))
        return (name.replace("_", self._joint) for name in modules)

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
    """A table whose entries are in many folders: each topic has its own.

    `package`: the package that is searched, with all its folders.
    `ending`: suffix of the modules' names: ``elbow_page`` is the entry ``elbow`` of "_page".
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
        places = {}
        for path in root.rglob(f"*{self._ending}.py"):
            parts = path.relative_to(root).with_suffix("").parts
            places[path.stem.removesuffix(self._ending)] = ".".join((self._package, *parts))
        return places

    def _listed(self) -> Iterable[str]:
        return self._places

    def _place(self, name: str) -> str:
        return self._places[name]
