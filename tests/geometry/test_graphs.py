"""Parts and cuts are those that SciPy finds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

from scan2bim.geometry.graphs import connected_parts, source_side


@pytest.mark.parametrize("seed", range(5))
def test_parts_are_connected_and_numbered_by_their_first_node(seed):
    pairs = np.random.default_rng(seed).integers(0, 60, (45, 2))
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(60, 60))
    assert (connected_parts(60, pairs) == connected_components(links, directed=False)[1]).all()


def test_without_links_each_node_is_a_part_of_its_own():
    assert connected_parts(3, np.zeros((0, 2), np.int64)).tolist() == [0, 1, 2]
    assert connected_parts(0, np.zeros((0, 2), np.int64)).tolist() == []


@pytest.mark.parametrize("seed", range(8))
def test_a_cut_is_minimal_and_has_as_few_nodes_as_possible_on_the_sources_side(seed):
    rng = np.random.default_rng(seed)
    gain, cost = rng.integers(-30, 30, 40), rng.integers(0, 12, 110)
    edges = rng.integers(0, 40, (110, 2))
    nodes, source, sink = np.arange(40), 40, 41
    rows = np.concatenate([edges[:, 0], edges[:, 1], np.full(40, source), nodes])
    cols = np.concatenate([edges[:, 1], edges[:, 0], nodes, np.full(40, sink)])
    caps = np.concatenate([cost, cost, np.maximum(gain, 0), np.maximum(-gain, 0)])
    graph: Any = coo_array((caps, (rows, cols)), shape=(42, 42)).tocsr().astype(np.int32)
    graph.indices, graph.indptr = graph.indices.astype(np.int32), graph.indptr.astype(np.int32)
    flow: Any = maximum_flow(graph, source, sink)
    residual = (graph - flow.flow).maximum(0).tocsr()
    residual.eliminate_zeros()
    reached = breadth_first_order(residual, source, return_predecessors=False)
    assert set(np.flatnonzero(source_side(gain, edges, cost))) == set(reached) - {source}


def test_a_cut_without_edges_follows_the_gains():
    gain = np.array([3, -1, 0])
    assert source_side(gain, np.zeros((0, 2), np.int64), np.zeros(0, np.int64)).tolist() == [True, False, False]
