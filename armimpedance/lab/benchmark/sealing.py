"""Seeds of both halves, and how a sealed truth is fixed beforehand. Standard library only.

Public seeds follow from names that everybody knows. Sealed seeds are a keyed hash of the same
names (HMAC-SHA256): who has the key makes the same records and the same truth again, who has not
cannot. The folder holds the SHA-256 of the key and, of each task, that of its sealed truth behind a
salt that is a keyed hash as well: small truths could be guessed and tried without one.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError

#: Bytes of a key; fewer could be tried one by one against the published hash.
KEY_BYTES: Final = 32
_NAME: Final = "armimpedance benchmark"


@dataclass(frozen=True, repr=False)
class Key:
    """The secret that sealed records are made from."""

    secret: bytes

    @classmethod
    def drawn(cls, file: Path) -> Key:
        """A new key, written where only its owner reads it.

        Raises
        ------
        InputError
            There is a file of that name, or it cannot be written.
        """
        key = cls(secrets.token_bytes(KEY_BYTES))
        try:
            descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror}", file=file) from None
        with os.fdopen(descriptor, "w", encoding="ascii") as stream:
            stream.write(key.secret.hex() + "\n")
        return key

    @classmethod
    def read(cls, file: Path) -> Key:
        """The key in a file: 64 hexadecimal digits.

        Raises
        ------
        InputError
            It is no such file.
        """
        expected = f"a key, {2 * KEY_BYTES} hexadecimal digits in one line"
        try:
            secret = bytes.fromhex(file.read_text(encoding="ascii").strip())
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", file=file) from None
        except ValueError:
            raise InputError("is no key", file=file, expected=expected) from None
        if len(secret) != KEY_BYTES:
            raise InputError(f"is a key of {len(secret)} bytes", file=file, expected=expected)
        return cls(secret)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the key, which is published."""
        return hashlib.sha256(self.secret).hexdigest()

    def salt(self, version: str, task: str) -> str:
        """What stands before a task's sealed truth when it is hashed."""
        return self.digest(version, task, "salt").hex()

    def digest(self, *words: str) -> bytes:
        """A keyed hash of some words."""
        return hmac.digest(self.secret, _said(*words), "sha256")


def seed_of(version: str, task: str, record: str, key: Key | None) -> int:
    """The seed of a record: a sealed one with its key, a public one without.

    Parameters
    ----------
    version, task, record : str
    key : Key or None

    Returns
    -------
    int
        Below 2^63.
    """
    if key is None:
        digest = hashlib.sha256(_said(version, task, record)).digest()
    else:
        digest = key.digest(version, task, record)
    return int.from_bytes(digest[:8], "big") >> 1


def commitment(salt: str, truth: str) -> str:
    """What is published of a sealed truth: SHA-256 of salt, line feed and the text of its table."""
    return hashlib.sha256(f"{salt}\n{truth}".encode()).hexdigest()


def _said(*words: str) -> bytes:
    return "/".join((_NAME, *words)).encode()
