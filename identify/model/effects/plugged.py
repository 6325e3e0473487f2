"""What an effect of a third party gives to the model is looked at: else a wrong matrix would be fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.core.plugin import PluginError, name_of, package_of
from identify.model.effects.base import Effect, Term

_ROUNDING = 1e-9
_MATRICES = ("stiffness", "damping", "mass", "hysteretic")


def check_terms(effect: Effect, terms: Sequence[Term], size: int) -> None:
    """Raise a PluginError that names the package whose effect gives anything but terms with symmetric
    matrices (size, size) of finite numbers.
    """
    if package_of(type(effect)) == __name__.partition(".")[0]:
        return
    for term in terms:
        if not isinstance(term, Term):
            raise PluginError(name_of(effect), f"a term of type {type(term).__name__}", "a Term")
        for role in _MATRICES:
            check_matrix(effect, f"the {role} of {term.parameter.name}", getattr(term, role), size)


def check_matrix(effect: Effect, what: str, matrix: Array | None, size: int) -> None:
    """The same of one matrix."""
    if matrix is None or package_of(type(effect)) == __name__.partition(".")[0]:
        return
    found, expected = np.asarray(matrix), f"a symmetric matrix ({size}, {size}) of numbers"
    if found.shape != (size, size):
        fault = f"a matrix of shape {found.shape}"
    elif not np.isfinite(found).all():
        fault = "a matrix with NaN or infinity in it"
    elif np.abs(found - found.T).max(initial=0.0) > _ROUNDING * np.abs(found).max(initial=0.0):
        fault = "a matrix that is not symmetric"
    else:
        return
    raise PluginError(name_of(effect), f"{what} is {fault}", expected, "tell its authors, or leave it out")
