"""API keys: kept as hashes only, compared in constant time."""

import hashlib
import hmac
import re
from collections.abc import Sequence

from brdfcore.errors import InvalidValueError

_SHORTEST = 16  # characters; a key is a random text that nobody types twice
_HASHED = re.compile(r"sha256:([0-9a-f]{64})")


def hashes(text: str) -> tuple[str, ...]:
    """The SHA-256 of each key in a text of keys, split at commas and spaces; `sha256:HEX` stands for a key's hash."""
    found = []
    for key in re.split(r"[,\s]+", text.strip()):
        hashed = _HASHED.fullmatch(key)
        if hashed:
            found.append(hashed[1])
        elif len(key) >= _SHORTEST and key.isascii() and key.isprintable():
            found.append(hash_of(key))
        elif key or not text.strip():
            raise InvalidValueError(
                f"Expected each API key to be {_SHORTEST} or more printable characters, or sha256: and 64 hexadecimal "
                f"digits, got one of {len(key)} characters. Make one with: openssl rand -hex 24.",
                field="api_keys",
            )
    return tuple(dict.fromkeys(found))


def hash_of(key: str) -> str:
    """The SHA-256 of a key, in hexadecimal digits."""
    return hashlib.sha256(key.encode()).hexdigest()


def owner_of(authorization: str, known: Sequence[str]) -> str | None:
    """The first 12 digits of the hash of the key in an Authorization header; None where no key is known there."""
    scheme, _, key = authorization.partition(" ")
    digest = hash_of(key.strip()) if scheme.lower() == "bearer" else ""
    found = [one for one in known if hmac.compare_digest(one, digest)]  # every one is compared
    return found[0][:12] if found else None
