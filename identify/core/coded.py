"""A sentence for people that keeps the code it was made of: what goes on reads the code, never the words."""

from __future__ import annotations


class Coded(str):
    """A sentence with its code."""

    code: str

    def __new__(cls, text: str, code: str) -> Coded:
        """The sentence of a code."""
        made = super().__new__(cls, text)
        made.code = code
        return made

    def __reduce__(self) -> tuple[type[Coded], tuple[str, str]]:
        """For workers, to which sentences are sent."""
        return Coded, (str(self), self.code)

    def and_(self, more: str) -> Coded:
        """The same with something behind it."""
        return Coded(f"{self}{more}", self.code)


def code_of(text: str) -> str:
    """The code of a sentence; empty where it has none, as of one that was read from a file."""
    return text.code if isinstance(text, Coded) else ""
