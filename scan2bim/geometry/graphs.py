"""Connected parts and minimal cuts of graphs. SciPy has both, but to load it takes longer than they do."""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

I64 = NDArray[np.int64]


def connected_parts(count: int, pairs: I64) -> I64:
    """For each of ``count`` nodes the number of its part (count,), given linked nodes (m, 2); parts are numbered by
    their first node.
    """
    return _parts(count, np.ascontiguousarray(pairs, np.int64))


def source_side(gain: I64, edges: I64, cost: I64) -> NDArray[np.bool_]:
    """The nodes (n,) on the source's side of a minimal cut, as few as possible.

    ``gain`` (n,) is what a node pays on the sink's side, or, negative, on the source's; ``edges`` (m, 2) part two nodes
    at their ``cost`` (m,), 0 or more. By Dinic's blocking flows.
    """
    count = len(gain)
    nodes = np.arange(count)
    apart = edges[:, 0] != edges[:, 1]
    edges, cost = edges[apart], cost[apart]
    tail = np.concatenate([edges[:, 0], np.full(count, count), nodes])
    head = np.concatenate([edges[:, 1], nodes, np.full(count, count + 1)])
    there = np.concatenate([cost, np.maximum(gain, 0), np.maximum(-gain, 0)])
    back = np.concatenate([cost, np.zeros(2 * count, np.int64)])
    return _reached(count + 2, tail, head, there.astype(np.int64), back.astype(np.int64))[:count]


@nb.njit(cache=True, nogil=True)
def join(parent, a, b):  # pyright: ignore
    """Make the parts of two nodes one, in a forest of ``parent`` (n,); a part's root is its first node."""
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    while parent[b] != b:
        parent[b] = parent[parent[b]]
        b = parent[b]
    parent[max(a, b)] = min(a, b)


@nb.njit(cache=True, nogil=True)
def _parts(count, pairs):  # pyright: ignore
    parent = np.arange(count)
    for k in range(pairs.shape[0]):
        join(parent, pairs[k, 0], pairs[k, 1])
    number = 0
    out = np.empty(count, np.int64)
    for i in range(count):
        if parent[i] == i:
            out[i] = number
            number += 1
        else:
            out[i] = out[parent[i]]
    return out


@nb.njit(cache=True, nogil=True)
def _reached(count, tail, head, there, back):  # pyright: ignore
    """Nodes that the last but one, the source, still reaches once as much as possible flows to the last."""
    m = tail.shape[0]
    first = np.zeros(count + 1, np.int64)
    for k in range(m):
        first[tail[k] + 1] += 1
        first[head[k] + 1] += 1
    first = np.cumsum(first)
    at = first[:-1].copy()
    to, twin, left = np.empty(2 * m, np.int64), np.empty(2 * m, np.int64), np.empty(2 * m, np.int64)
    for k in range(m):
        a, b = at[tail[k]], at[head[k]]
        at[tail[k]] += 1
        at[head[k]] += 1
        to[a], twin[a], left[a] = head[k], b, there[k]
        to[b], twin[b], left[b] = tail[k], a, back[k]
    level = _levels(first, to, left, count - 2)
    while level[count - 1] >= 0:
        _fill(first, to, twin, left, level)
        level = _levels(first, to, left, count - 2)
    return level >= 0


@nb.njit(cache=True, nogil=True)
def _levels(first, to, left, source):  # pyright: ignore
    """Arcs from the source to each node by arcs with capacity left, -1 where it is not reached."""
    level = np.full(first.shape[0] - 1, -1, np.int64)
    queue = np.empty(level.shape[0], np.int64)
    level[source] = 0
    queue[0] = source
    begin, end = 0, 1
    while begin < end:
        node = queue[begin]
        begin += 1
        for arc in range(first[node], first[node + 1]):
            if left[arc] > 0 and level[to[arc]] < 0:
                level[to[arc]] = level[node] + 1
                queue[end] = to[arc]
                end += 1
    return level


@nb.njit(cache=True, nogil=True)
def _fill(first, to, twin, left, level):  # pyright: ignore
    """Let flow what can along arcs from level to level, until none is left."""
    source, sink = level.shape[0] - 2, level.shape[0] - 1
    arc_of = first[:-1].copy()
    path = np.empty(level.shape[0], np.int64)
    depth, node = 0, source
    while True:
        if node == sink:
            least = left[path[0]]
            for k in range(1, depth):
                least = min(least, left[path[k]])
            full = depth
            for k in range(depth - 1, -1, -1):
                left[path[k]] -= least
                left[twin[path[k]]] += least
                if left[path[k]] == 0:
                    full = k
            depth = full
            node = to[twin[path[full]]]
        arc = arc_of[node]
        if arc < first[node + 1]:
            if left[arc] > 0 and level[to[arc]] == level[node] + 1:
                path[depth] = arc
                depth += 1
                node = to[arc]
            else:
                arc_of[node] += 1
        elif depth == 0:
            return
        else:
            depth -= 1
            node = to[twin[path[depth]]]
            arc_of[node] += 1
