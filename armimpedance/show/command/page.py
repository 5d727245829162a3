"""What a page may be called."""

from __future__ import annotations

from typing import Final

PAGE: Final = (".html",)
