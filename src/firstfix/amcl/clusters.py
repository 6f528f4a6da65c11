"""Clusters of a belief: connected bins with mass, mean and covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firstfix.amcl.bins import (
    EMPTY,
    FIRST_ENTRIES,
    HEADINGS,
    bin_of,
    key_of,
    new_table,
    slot_of,
    with_room,
)
from firstfix.amcl.particles import Particles
from firstfix.core.se2 import SE2
from firstfix.fields.kernel_cache import kernel

# A belief over a whole building has hundreds of clusters; only the heaviest are described.
MAX_CLUSTERS = 24


@dataclass(frozen=True, eq=False, slots=True)
class Cluster:
    """One place of a belief.

    Parameters
    ----------
    mass : float
        Probability of the place, 0 to 1.
    pose : SE2
        Mean of ``T_map_base``, circular in yaw.
    covariance : ndarray, shape (3, 3)
        Of x (m), y (m), yaw (rad) in the map frame, about the pose. Made read-only.
    """

    mass: float
    pose: SE2
    covariance: NDArray[np.float64]

    def __post_init__(self) -> None:
        self.covariance.flags.writeable = False


def find_clusters(particles: Particles, emphasis: NDArray[np.float64]) -> tuple[Cluster, ...]:
    """Group particles whose bins touch, and describe the heaviest groups.

    Parameters
    ----------
    particles : Particles
        The belief: it gives mass and covariance.
    emphasis : ndarray, shape (n,)
        Weights for the mean pose of a group; the particles' own, or sharper ones.

    Returns
    -------
    tuple of Cluster
        1 to 24, heaviest first.
    """
    x, y, yaw = particles.x, particles.y, particles.yaw
    label, count = _label(x, y, yaw)
    mass, mean, covariance = _moments(x, y, yaw, particles.weight, emphasis, label, count)
    order = np.argsort(-mass, kind="stable")[:MAX_CLUSTERS].tolist()
    return tuple(
        Cluster(float(mass[i]), SE2.from_array(mean[i]), covariance[i].copy())
        for i in order
        if mass[i] > 0.0
    )


@kernel
def _label(
    x: NDArray[np.float64], y: NDArray[np.float64], yaw: NDArray[np.float64]
) -> tuple[NDArray[np.int64], int]:
    """Label particles by the connected group of their bin: 26 neighbours, headings all round."""
    n = x.shape[0]
    table = new_table(FIRST_ENTRIES)
    bins = np.empty((n, 3), np.int64)
    bin_index = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        column, row, turn = bin_of(x[i], y[i], yaw[i])
        key = key_of(column, row, turn)
        slot = slot_of(table, key)
        if table[slot, 0] == EMPTY:
            table = with_room(table, count)
            slot = slot_of(table, key)
            table[slot, 0], table[slot, 1] = key, count
            bins[count, 0], bins[count, 1], bins[count, 2] = column, row, turn
            count += 1
        bin_index[i] = table[slot, 1]
    parent = np.arange(count)
    for b in range(count):
        for neighbour in range(27):
            column = bins[b, 0] + neighbour // 9 - 1
            row = bins[b, 1] + neighbour // 3 % 3 - 1
            turn = (bins[b, 2] + neighbour % 3 - 1) % HEADINGS
            slot = slot_of(table, key_of(column, row, turn))
            if table[slot, 0] != EMPTY:
                _join(parent, b, table[slot, 1])
    # Groups are numbered in the order of their first particle.
    number = np.full(count, -1, np.int64)
    groups = 0
    label = np.empty(n, np.int64)
    for i in range(n):
        root = _root(parent, bin_index[i])
        if number[root] < 0:
            number[root] = groups
            groups += 1
        label[i] = number[root]
    return label, groups


@kernel
def _join(parent: NDArray[np.int64], a: int, b: int) -> None:
    a, b = _root(parent, a), _root(parent, b)
    parent[max(a, b)] = min(a, b)


@kernel
def _root(parent: NDArray[np.int64], i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@kernel
def _moments(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    yaw: NDArray[np.float64],
    weight: NDArray[np.float64],
    emphasis: NDArray[np.float64],
    label: NDArray[np.int64],
    count: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Sum up mass, mean pose and covariance of every group.

    Headings are averaged as wrapped differences to the first of the group, which takes a third of
    the time of sines and cosines: a group is far narrower than a half turn, or has no mean. Sums
    stay in registers while consecutive particles are of one group, which saves another third.
    """
    mass, mean = _means(x, y, yaw, weight, emphasis, label, count)
    covariance = np.zeros((count, 3, 3))
    k = -1
    xx = xy = xt = yy = yt = tt = 0.0
    for i in range(x.shape[0]):
        if label[i] != k:
            if k >= 0:
                _put(covariance[k], xx, xy, xt, yy, yt, tt)
            k = label[i]
            of = covariance[k]
            xx, xy, xt, yy, yt, tt = of[0, 0], of[0, 1], of[0, 2], of[1, 1], of[1, 2], of[2, 2]
        w = weight[i]
        dx, dy = x[i] - mean[k, 0], y[i] - mean[k, 1]
        turn = _wrapped(yaw[i] - mean[k, 2])
        xx += w * dx * dx
        xy += w * dx * dy
        xt += w * dx * turn
        yy += w * dy * dy
        yt += w * dy * turn
        tt += w * turn * turn
    if k >= 0:
        _put(covariance[k], xx, xy, xt, yy, yt, tt)
    for k in range(count):
        if mass[k] > 0.0:
            for a in range(3):
                for b in range(a, 3):
                    covariance[k, a, b] /= mass[k]
                    covariance[k, b, a] = covariance[k, a, b]
    return mass, mean, covariance


@kernel
def _put(
    covariance: NDArray[np.float64],
    xx: float,
    xy: float,
    xt: float,
    yy: float,
    yt: float,
    tt: float,
) -> None:
    covariance[0, 0], covariance[0, 1], covariance[0, 2] = xx, xy, xt
    covariance[1, 1], covariance[1, 2], covariance[2, 2] = yy, yt, tt


@kernel
def _means(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    yaw: NDArray[np.float64],
    weight: NDArray[np.float64],
    emphasis: NDArray[np.float64],
    label: NDArray[np.int64],
    count: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mass and mean pose of every group."""
    mass, shares = np.zeros(count), np.zeros(count)
    first = np.full(count, -1, np.int64)
    mean = np.zeros((count, 3))
    k = -1
    m = s = sum_x = sum_y = sum_yaw = 0.0
    x0 = y0 = yaw0 = 0.0
    for i in range(x.shape[0]):
        if label[i] != k:
            if k >= 0:
                mass[k], shares[k] = m, s
                mean[k, 0], mean[k, 1], mean[k, 2] = sum_x, sum_y, sum_yaw
            k = label[i]
            if first[k] < 0:
                first[k] = i
            m, s = mass[k], shares[k]
            sum_x, sum_y, sum_yaw = mean[k, 0], mean[k, 1], mean[k, 2]
            x0, y0, yaw0 = x[first[k]], y[first[k]], yaw[first[k]]
        w = emphasis[i]
        m += weight[i]
        s += w
        sum_x += w * (x[i] - x0)
        sum_y += w * (y[i] - y0)
        sum_yaw += w * _wrapped(yaw[i] - yaw0)
    if k >= 0:
        mass[k], shares[k] = m, s
        mean[k, 0], mean[k, 1], mean[k, 2] = sum_x, sum_y, sum_yaw
    for k in range(count):
        share = 1.0 / shares[k] if shares[k] > 0.0 else 0.0
        mean[k, 0] = x[first[k]] + share * mean[k, 0]
        mean[k, 1] = y[first[k]] + share * mean[k, 1]
        mean[k, 2] = yaw[first[k]] + share * mean[k, 2]
    return mass, mean


@kernel
def _wrapped(turn: float) -> float:
    return turn - 2.0 * math.pi * math.ceil(turn / (2.0 * math.pi) - 0.5)
