"""Footstep search, compiled: an anytime A* over a lattice of body poses.

Rounds of weighted A* that keep what they have found, then A* itself, as ARA* does (Likhachev, Gordon, Thrun, ARA*:
Anytime A* with provable bounds on sub-optimality, NIPS 2003). The weighted rounds follow a guess that may be too long,
so the proven bound comes from the admissible one alone (``footstep_guides``). Budgets are counted in expansions, never
in seconds: a plan is a function of its inputs.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from teleop_sim.robot.footstep_guides import bound, guess
from teleop_sim.robot.footstep_nodes import Found, Nodes, add, grown, key_of, no_nodes, slot, state_of, way_to
from teleop_sim.robot.law_math import compiled


class Steps(NamedTuple):
    """What a robot can do.

    ``actions``: (2, bins, a, 3) moves (di, dj, dk) of the body when that foot steps next; ``costs``: (2, bins, a) [s];
    ``counts``: (2, bins) how many there are; ``soles``: (2, bins, 2) the foot's place in cells from the body's.
    """

    actions: np.ndarray
    costs: np.ndarray
    counts: np.ndarray
    soles: np.ndarray


class Ground(NamedTuple):
    """Where it can be: masks over the nodes (ni, nj).

    ``legs``, ``arms``, ``discs``: see ``blocked_on_way``. ``drops``: where no sole may be. ``extra``: cost of a step to
    there [s].
    """

    legs: np.ndarray
    arms: np.ndarray
    discs: np.ndarray
    drops: np.ndarray
    extra: np.ndarray


class Guides(NamedTuple):
    """Where to look first: see ``footstep_guides.bound`` and ``guess``. The goal's yaw is bin 0."""

    goal: tuple[int, int]
    tenths: np.ndarray
    free: np.ndarray
    figures: np.ndarray
    way: np.ndarray
    after: np.ndarray
    turning: np.ndarray


@compiled
def blocked_on_way(
    i: int, j: int, k: int, di: int, dj: int, dk: int, legs: np.ndarray, arms: np.ndarray, discs: np.ndarray
) -> bool:
    """Whether a body that moves from one lattice pose by (di, dj, dk) would come too near to something.

    It is looked at once a cell or bin of yaw on its way: the legs as a disc in the middle, the arms as discs at
    ``discs`` (bins, n, 2), in cells from the middle. Beyond the lattice everything is blocked.
    """
    ni, nj = legs.shape
    bins = discs.shape[0]
    n = max(1, max(abs(di), max(abs(dj), abs(dk))))
    for s in range(1, n + 1):
        a, b = i + int(np.floor(di * s / n + 0.5)), j + int(np.floor(dj * s / n + 0.5))
        if a < 0 or b < 0 or a >= ni or b >= nj or legs[a, b]:
            return True
        c = (k + int(np.floor(dk * s / n + 0.5))) % bins
        for d in range(discs.shape[1]):
            u, v = a + discs[c, d, 0], b + discs[c, d, 1]
            if 0 <= u < ni and 0 <= v < nj and arms[u, v]:
                return True
    return False


@compiled
def search(
    seeds: np.ndarray,
    seed_costs: np.ndarray,
    steps: Steps,
    ground: Ground,
    guides: Guides,
    weights: np.ndarray,
    budget: int,
) -> tuple[float, float, np.ndarray, int]:
    """Anytime search: first ways by guess, then the best one by bound, while the budget of expansions lasts.

    Args:
        seeds: (n, 4) first states i, j, k and the foot that has stepped there; seed_costs: (n,) [s].
        weights: of the guess in successive rounds; in the last round, weight 0, the bound takes its place.
        budget: expansions in all.

    Returns:
        Cost [s], inf without a way; proven lower bound of it [s], inf if it is proven that there is no way; states of
        the way (m, 4); expansions.
    """
    nodes, found = _sown(seeds, seed_costs, steps, ground, guides)
    for turn in range(weights.size):
        nodes, found = _round(turn, weights[turn], budget, nodes, found, steps, ground, guides)
    least = _least(nodes, found)
    if found.goal_node < 0:
        return np.inf, least, np.empty((0, 4), np.int64), found.expanded
    way = way_to(found.goal_node, nodes, ground.legs.shape[1], steps.counts.shape[1])
    return found.best, least, way, found.expanded


@compiled
def _sown(
    seeds: np.ndarray, seed_costs: np.ndarray, steps: Steps, ground: Ground, guides: Guides
) -> tuple[Nodes, Found]:
    """The first states."""
    nodes = no_nodes()
    used, goal_node, best = 0, -1, np.inf
    nj, bins = ground.legs.shape[1], steps.counts.shape[1]
    for s in range(seeds.shape[0]):
        i, j, k, foot = seeds[s]
        key = key_of(i, j, k, foot, nj, bins)
        at = slot(nodes.table, nodes.keys, key)
        if nodes.table[at] < 0:
            add(nodes, at, used, key, bound(i, j, k, foot, guides.goal, guides.tenths, guides.free, guides.figures))
            guessed = guess(i, j, k, guides.way, guides.after, guides.turning, guides.figures[1])
            nodes.parent[used], nodes.g[used], nodes.hint[used] = -1, np.inf, guides.figures[0] * guessed
            used += 1
        node = nodes.table[at]
        nodes.g[node] = min(nodes.g[node], seed_costs[s])
        if k == 0 and i == guides.goal[0] and j == guides.goal[1] and nodes.g[node] < best:
            goal_node, best = node, nodes.g[node]
    return nodes, Found(used, goal_node, best, 0)


@compiled
def _round(
    turn: int, weight: float, budget: int, nodes: Nodes, found: Found, steps: Steps, ground: Ground, guides: Guides
) -> tuple[Nodes, Found]:
    """Expand states in the order of cost and guess (``weight`` 0: bound) until none can better the known way."""
    # Arrays by their own names, and in one function: looked up or handed on they are counted each time, half as long
    # again.
    table, keys, parent, closed, g, v, h, hint = nodes
    used, goal_node, best, expanded = found
    goal, tenths, free, figures, path, after, turning = guides
    actions, costs, counts, soles = steps
    legs, arms, discs, drops, extra = ground
    nj, bins = legs.shape[1], counts.shape[1]
    heap = _queue(nodes, found, weight)
    while expanded < budget:
        f, _, node = heapq.heappop(heap)
        if f >= best or f == np.inf:
            break
        if closed[node] == turn or g[node] >= v[node]:
            continue
        closed[node], v[node] = turn, g[node]
        expanded += 1
        if used + actions.shape[2] >= keys.size:
            nodes = grown(nodes, used)
            table, keys, parent, closed, g, v, h, hint = nodes
        i, j, k, foot = state_of(keys[node], nj, bins)
        foot = 1 - foot
        for a in range(counts[foot, k]):
            di, dj, dk = actions[foot, k, a]
            ti, tj, tk = i + di, j + dj, (k + dk) % bins
            if not _stands(ti, tj, ti + soles[foot, tk, 0], tj + soles[foot, tk, 1], drops):
                continue
            cost = g[node] + costs[foot, k, a] + extra[ti, tj]
            to = key_of(ti, tj, tk, foot, nj, bins)
            at = slot(table, keys, to)
            there = table[at]
            if there >= 0 and cost >= g[there] - 1e-12:
                continue
            least = h[there] if there >= 0 else bound(ti, tj, tk, foot, goal, tenths, free, figures)
            if cost + least >= best or blocked_on_way(i, j, k, di, dj, dk, legs, arms, discs):
                continue
            if there < 0:
                there = used
                table[at], keys[there], v[there], closed[there], h[there] = there, to, np.inf, -1, least
                hint[there] = figures[0] * guess(ti, tj, tk, path, after, turning, figures[1])
                used += 1
            g[there], parent[there] = cost, node
            if tk == 0 and ti == goal[0] and tj == goal[1] and cost < best:
                goal_node, best = there, cost
            if closed[there] != turn:
                heapq.heappush(heap, (cost + (weight * hint[there] if weight > 0.0 else least), least, there))
    return nodes, Found(used, goal_node, best, expanded)


@compiled
def _stands(i: int, j: int, si: int, sj: int, drops: np.ndarray) -> bool:
    """Whether body and sole are on the lattice, and the sole not over a drop."""
    ni, nj = drops.shape
    return 0 <= i < ni and 0 <= j < nj and 0 <= si < ni and 0 <= sj < nj and not drops[si, sj]


@compiled
def _queue(nodes: Nodes, found: Found, weight: float) -> list[tuple[float, float, int]]:
    """States to look at in a new round: those that became cheaper since last expanded and may still serve."""
    heap = [(np.inf, np.inf, found.used)]
    for node in range(found.used):
        if nodes.g[node] < nodes.v[node] and nodes.g[node] + nodes.h[node] < found.best:
            key_s = nodes.g[node] + (weight * nodes.hint[node] if weight > 0.0 else nodes.h[node])
            heap.append((key_s, nodes.h[node], node))
    heapq.heapify(heap)
    return heap


@compiled
def _least(nodes: Nodes, found: Found) -> float:
    """What every way costs at least, by the states still to be expanded."""
    least = found.best
    for node in range(found.used):
        if nodes.g[node] < nodes.v[node]:
            least = min(least, nodes.g[node] + nodes.h[node])
    return least
