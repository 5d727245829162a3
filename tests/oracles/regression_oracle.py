"""The regression core written as its definitions read: raw samples, loops, refits.

W is a list of (S_t, p), Y a list of (S_t, q). Parameters run over regressors first, then outputs.
"""

import numpy as np


def solve(W, Y):
    """Least squares on the stacked samples, (p, q)."""
    return np.linalg.lstsq(np.concatenate(W), np.concatenate(Y), rcond=None)[0]


def residuals(W, Y):
    theta = solve(W, Y)
    return [y - w @ theta for w, y in zip(W, Y, strict=True)]


def _bread(W, q):
    stacked = np.concatenate(W)
    return np.kron(np.eye(q), np.linalg.inv(stacked.T @ stacked))


def classical(W, Y):
    """sigma^2 (W^T W)^-1 with the residuals' covariance between outputs."""
    w, e = np.concatenate(W), np.concatenate(residuals(W, Y))
    sigma = e.T @ e / (len(w) - w.shape[1])
    return np.kron(sigma, np.linalg.inv(w.T @ w))


def cluster_cr1(W, Y):
    """Sum over clusters of score times score, with the usual small-sample factor."""
    p, q, G = W[0].shape[1], Y[0].shape[1], len(W)
    N = sum(len(w) for w in W)
    meat = np.zeros((p * q, p * q))
    for w, e in zip(W, residuals(W, Y), strict=True):
        score = np.zeros(p * q)
        for i in range(len(w)):
            for output in range(q):
                for regressor in range(p):
                    score[output * p + regressor] += w[i, regressor] * e[i, output]
        meat += np.outer(score, score)
    bread = _bread(W, q)
    return G / (G - 1) * (N - 1) / (N - p) * bread @ meat @ bread


def leave_one_out(W, Y):
    """One refit on the samples per cluster, (T, p, q)."""
    T = len(W)
    return np.stack(
        [
            solve([W[s] for s in range(T) if s != t], [Y[s] for s in range(T) if s != t])
            for t in range(T)
        ]
    )


def cluster_cr3(W, Y):
    """The jackknife over clusters, by refits."""
    G, theta = len(W), solve(W, Y)
    changes = [(without - theta).T.ravel() for without in leave_one_out(W, Y)]
    return (G - 1) / G * sum(np.outer(c, c) for c in changes)


def replicates(W, Y, strata):
    """Within-stratum covariance of each trial's score, scaled by its number, between the breads."""
    q = Y[0].shape[1]
    bread, E = _bread(W, q), residuals(W, Y)
    scores = [np.concatenate([w.T @ e[:, j] for j in range(q)]) for w, e in zip(W, E, strict=True)]
    meat = 0.0
    for label in set(strata):
        mine = np.array([s for s, known in zip(scores, strata, strict=True) if known == label])
        meat = meat + len(mine) * np.atleast_2d(np.cov(mine, rowvar=False))
    return bread @ meat @ bread


def hac(W, Y, lag):
    """Bartlett-weighted products of scores at all pairs of rows of a trial, by a double loop."""
    p, q = W[0].shape[1], Y[0].shape[1]
    meat = np.zeros((p * q, p * q))
    for w, e in zip(W, residuals(W, Y), strict=True):
        u = [np.outer(e[i], w[i]).ravel() for i in range(len(w))]
        for i in range(len(w)):
            for j in range(len(w)):
                if abs(i - j) <= lag:
                    meat += (1 - abs(i - j) / (lag + 1)) * np.outer(u[i], u[j])
    bread = _bread(W, q)
    return bread @ meat @ bread


def weighted_refit(W, Y, counts):
    """Refit on samples in which cluster t is repeated counts[t] times."""
    repeated = [t for t, n in enumerate(counts) for _ in range(int(n))]
    return solve([W[t] for t in repeated], [Y[t] for t in repeated])
