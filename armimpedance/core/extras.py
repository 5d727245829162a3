"""Packages that only some formats need: imported when such a file is read, named if missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from armimpedance.core.errors import InputError


def needed(module: str, extra: str, file: object) -> Any:
    """Import a package that an extra of the installation brings.

    Parameters
    ----------
    module : str
        What is imported, such as ``"h5py"``.
    extra : str
        The extra of `pyproject.toml` that brings it, such as ``"matlab"``.
    file : path
        The file that needs it, for the message.

    Raises
    ------
    InputError
        The package is not installed; the message says how to install it.
    """
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(
            f"the package {package} is not installed",
            file=file,
            expected=f"it: pip install 'armimpedance[{extra}]'",
        ) from None
