"""How sure least-squares values are where residuals are correlated, or not what they should be, inside blocks
of the data: the delete-a-block jackknife, with the degrees of freedom that few blocks leave.

Every block is left out in turn, and the values move by as much as it had pulled them (to first order, with no
fit).  That is the cluster-robust covariance CR3 of Bell and McCaffrey (Survey Methodology 28-2, 2002), and
its intervals are Student's with the degrees of freedom of their Satterthwaite approximation: a value that
hangs on three blocks is known like the mean of three numbers.
"""

from __future__ import annotations

import numpy as np
import scipy

from identify.core.arrays import Array, Index

_LEAST = 2.0
"""Degrees of freedom at least: with fewer, Student's intervals have no standard deviation."""


def block_jackknife(jacobian: Array, residual: Array, blocks: Index, prior: Array) -> tuple[Array, Array]:
    """Covariance (p, p) of least-squares values, and degrees of freedom of each (p,).

    jacobian (n, p) and residual (n,) in units of the noise; blocks (n,): number of the block of each row,
    from 0, none empty; prior (p,): one over the variance that each value has without data.
    """
    order = np.argsort(blocks, kind="stable")
    ends = np.flatnonzero(np.diff(blocks[order], prepend=-1))
    rows = np.split(jacobian[order], ends[1:])
    parts = np.array([part.T @ part for part in rows])
    scores = np.add.reduceat(jacobian[order] * residual[order, None], ends, axis=0)
    whole = parts.sum(axis=0) + np.diag(prior)
    left_out = np.linalg.inv(whole - parts)
    moved = np.einsum("bij,bj->bi", left_out, scores)
    return np.asarray(moved.T @ moved), _freedom(left_out, parts, np.linalg.inv(whole))


def scatter_of_blocks(parts: Array, scores: Array, prior: Array) -> tuple[Array, Array]:
    """(p,): variance of values by leaving each block out; the same where residuals are independent.

    parts (b, p, p) and scores (b, p): J'J and J'e of each block; prior (p,): what is known of each value
    without data.  The scores at the values have the variance A_b - A_b W^-1 A_b, with W the sum of all parts
    and the prior; so that leaving a block out, by (W - A_b)^-1, has in all sum (W - A_b)^-1 A_b W^-1.
    """
    whole = parts.sum(axis=0) + np.diag(prior)
    bread, left = np.linalg.inv(whole), whole - parts
    moved = np.linalg.solve(left, scores[..., None])[..., 0]
    expected = np.einsum("bij,ji->i", np.linalg.solve(left, parts), bread)
    return np.asarray(np.sum(moved**2, axis=0)), np.asarray(expected)


def _freedom(left_out: Array, parts: Array, inverse: Array) -> Array:
    """Satterthwaite's degrees of freedom (p,) of every variance under independent noise: tr(G)^2 / tr(G^2).

    G (blocks, blocks) is the covariance of what each block moves a value by, of residuals (1 - H) e.
    """
    found = []
    for number in range(inverse.shape[0]):
        pulled = np.einsum("bij,bj->bi", parts, left_out[:, :, number])
        own = np.einsum("bj,bj->b", left_out[:, :, number], pulled)
        spread = np.diag(own) - pulled @ inverse @ pulled.T
        found.append(np.trace(spread) ** 2 / max(float((spread**2).sum()), 1e-300))
    return np.asarray(np.maximum(np.array(found), _LEAST))


def widening(freedom: Array) -> Array:
    """Half a 95 % interval of Student's t with these degrees of freedom, over that of the normal
    distribution.
    """
    return np.asarray(scipy.special.stdtrit(freedom, 0.975) / scipy.special.ndtri(0.975))
