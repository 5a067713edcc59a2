"""Pairs of modes that a turn of the film maps to each other: equal, however a mesh splits them.

A film that a turn by 360/n degrees, n > 2, leaves as it is has pairs of modes of exactly one
frequency (two-dimensional representations of its group).  A mesh without that symmetry splits them
by its error, and picks their directions.  Whether two modes are such a pair shows in themselves:
turned, each is a combination of both.
"""

from __future__ import annotations

import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.deflections import Deflections

TURNS = (3, 4, 5, 6, 7, 8)  # of a whole turn: those that a film may have
HARMONICS = 13  # angular orders in which modes are compared
POWERS = (0, 2, 4)  # of the radius, beyond the order
ALIKE = 1e-3  # of a pair: what turned modes may have beside it
MIXED = 0.1  # sine of the angle by which a turn mixes a pair, at least


def pairs(modes: Deflections, near: list[np.ndarray]) -> list[np.ndarray]:
    """Those of groups of near modes that are pairs by symmetry. Collective."""
    two = [group for group in near if len(group) == 2]
    if not two:
        return []
    content = _content(modes)
    return [group for group in two if any(_turned(content[group], n) for n in TURNS)]


def _turned(content: np.ndarray, n: int) -> bool:
    """Whether a turn by 1/n mixes two modes of some content (2, p, s) among themselves."""
    phase = np.exp(2j * np.pi / n * np.arange(content.shape[1]))
    before, after = (
        np.hstack([c.real.reshape(2, -1), c.imag.reshape(2, -1)])
        for c in (content, content * phase[:, None])
    )
    mixture = np.linalg.lstsq(before.T, after.T, rcond=None)[0].T
    beside = np.linalg.norm(after - mixture @ before) / np.linalg.norm(after)
    return bool(beside < ALIKE and abs(mixture[0, 1] - mixture[1, 0]) > 2 * MIXED)


def _content(modes: Deflections) -> np.ndarray:
    """Products (L, p, s) of shapes with r^(p + s) exp(i p theta) about the film's centroid."""
    film = modes.film
    moments, reach = np.zeros(3), 0.0
    for field in quadrature.fields(film, columns=2):
        ones = np.ones((*field.weights.shape, 1))
        columns = np.concatenate([ones, field.points], axis=2)
        moments += np.einsum("cq,cqd->d", field.weights, columns)
    moments = film.domain.comm.allreduce(moments)
    centre = moments[1:] / moments[0]
    nodes = film.domain.mesh.geometry.x[:, :2]
    reach = max(film.domain.comm.allgather(np.linalg.norm(nodes - centre, axis=1).max(initial=0.0)))
    total = np.zeros((modes.shapes.shape[1], HARMONICS, len(POWERS)), dtype=complex)
    for field in quadrature.fields(film, columns=2 * HARMONICS * len(POWERS)):
        z = ((field.points - centre) / reach) @ np.array([1, 1j])
        weighted = field.weights[..., None] * field.value(modes.shapes)
        for p in range(HARMONICS):
            for s, power in enumerate(POWERS):
                total[:, p, s] += np.einsum("cq,cqn->n", z**p * np.abs(z) ** power, weighted)
    return np.asarray(film.domain.comm.allreduce(total))
