"""Names that users give, as names of groups in HDF5, without blanks: `day1/posture 1` is one, no path."""

from __future__ import annotations

from urllib.parse import quote, unquote

ENCODED = "name_encoded"
"""Attribute of a group whose name stands for another one; files from before have none."""


def group_name(key: str) -> str:
    """The name of the group for a key: itself, or percent-encoded where it has blanks or would be a path; no
    two keys have the same.
    """
    plain = key.isprintable() and not set(key) & set("/% ") and key not in ("", ".", "..")
    return key if plain else quote(key, safe="").replace(".", "%2E") or "%"


def key_of(name: str, encoded: bool) -> str:
    """The key that a group's name stands for."""
    return unquote(name) if encoded and name != "%" else "" if encoded else name
