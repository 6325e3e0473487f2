"""The errors that a user can cause; each is one sentence that says where, what was found, what was expected
and what to do.
"""

_LONGEST = 1000
"""Characters of what was found that are printed: a damaged file may be one line."""
EXIT_DONE, EXIT_BAD_INPUT, EXIT_FAILED_CHECK, EXIT_NOT_CONVERGED, EXIT_INTERRUPTED = 0, 2, 3, 4, 130


class InputError(Exception):
    """Input that cannot be used as it is: the command line prints the sentence and exits with code 2.

    `where` is a file, a key of the config, or both; `found`, `expected` and `fix` are parts of the sentence.
    """

    def __init__(self, where: str, found: str, expected: str = "", fix: str = "") -> None:
        if len(found) > _LONGEST:
            found = f"{found[: _LONGEST // 2]} … {found[-_LONGEST // 2 :]}"
        parts = [f"{where}: {found}"]
        if expected:
            parts.append(f"expected {expected}")
        if fix:
            parts.append(fix)
        whole = "; ".join(parts)
        super().__init__(whole if whole.endswith("?") else whole + ".")
        self.where, self.found, self.expected, self.fix = where, found, expected, fix


class InputErrors(Exception):
    """Several independent input errors, reported together."""

    def __init__(self, errors: list[InputError]) -> None:
        super().__init__("\n".join(str(error) for error in errors))
        self.errors = errors
