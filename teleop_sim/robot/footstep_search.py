"""Footstep search, compiled: ARA* over a lattice of body poses, and its bound from an eight-neighbour distance map.

Methods: Likhachev, Gordon, Thrun, ARA*: Anytime A* with provable bounds on sub-optimality, NIPS 2003. The distance map is
Dijkstra's (1959) with Dial's buckets (Comm. ACM 12 (1969), 632-633). Budgets are counted in expansions, never in seconds: a
plan is a function of its inputs.
"""

from __future__ import annotations

import heapq

import numpy as np

from teleop_sim.robot.law_math import compiled

STRAIGHT, DIAGONAL = 10, 14
"""Costs of a step in the distance map; 14 is less than 10 times the root of 2, so distances are never too long."""

OCTILE = 0.9238795325112867
"""Cosine of 22.5 degrees: a straight way is at least this share of the shortest eight-neighbour way."""

NOT_FOUND, FOUND, SPENT = 0, 1, 2


@compiled
def distance_map(blocked: np.ndarray, i0: int, j0: int, i1: int, j1: int, beyond: int) -> np.ndarray:
    """Eight-neighbour distance (ni, nj) of every cell to (i0, j0), in tenths of a cell.

    It stops ``beyond`` further than (i1, j1); cells not reached then get the distance at which it stopped, which is not
    longer than theirs. All but those are exact for costs 10 and 14. If (i1, j1) cannot be reached its entry is -1.
    """
    ni, nj = blocked.shape
    far = 2**30
    best = np.full((ni, nj), far, np.int32)
    heads = np.full(DIAGONAL + 1, -1, np.int32)
    cells, following = np.empty(9 * ni * nj + 1, np.int32), np.empty(9 * ni * nj + 1, np.int32)
    best[i0, j0], cells[0], following[0], heads[0], used, waiting = 0, i0 * nj + j0, -1, 0, 1, 1
    now, limit = 0, far
    while waiting > 0 and now <= limit:
        bucket = now % (DIAGONAL + 1)
        at = heads[bucket]
        heads[bucket] = -1
        while at >= 0:
            i, j = cells[at] // nj, cells[at] % nj
            at = following[at]
            waiting -= 1
            if best[i, j] != now:
                continue
            if i == i1 and j == j1:
                limit = now + beyond
            for di in range(-1, 2):
                for dj in range(-1, 2):
                    a, b = i + di, j + dj
                    if a < 0 or b < 0 or a >= ni or b >= nj or blocked[a, b]:
                        continue
                    there = now + (DIAGONAL if di != 0 and dj != 0 else STRAIGHT)
                    if there < best[a, b]:
                        best[a, b] = there
                        to = there % (DIAGONAL + 1)
                        cells[used], following[used], heads[to] = a * nj + b, heads[to], used
                        used += 1
                        waiting += 1
        now += 1
    lost = best[i1, j1] == far
    for i in range(ni):
        for j in range(nj):
            best[i, j] = min(best[i, j], now)
    if lost:
        best[i1, j1] = -1
    return best


@compiled
def blocked_on_way(
    i: int, j: int, k: int, di: int, dj: int, dk: int, legs: np.ndarray, arms: np.ndarray, discs: np.ndarray
) -> bool:
    """Whether a body that moves from one lattice pose by (di, dj, dk) would come too near to something.

    It is looked at once a cell or bin of yaw on its way: the legs as a disc in the middle, the arms as discs at ``discs``
    (bins, n, 2), in cells from the middle. Beyond the lattice everything is blocked.
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
def bound(i: int, j: int, k: int, i0: int, j0: int, tenths: np.ndarray, bins: int, figures: np.ndarray) -> float:
    """Least cost [s] from a pose to the goal (i0, j0, 0); never more than the true one.

    ``figures``: time of a step [s], its longest move [cells] and turn [bins], cost of a cell [s] and of a bin [s].
    """
    step_s, longest, widest, cell_s, bin_s = figures
    di, dj = i - i0, j - j0
    straight = max(np.sqrt(di * di + dj * dj), OCTILE * 0.1 * tenths[i, j])
    turn = min(k, bins - k)
    steps = np.ceil(max(straight / longest, turn / widest) - 1e-9)
    return float(steps * step_s + straight * cell_s + turn * bin_s)


@compiled
def _slot(table: np.ndarray, keys: np.ndarray, key: int) -> int:
    """Where in the hash table a key is or belongs."""
    mask = table.size - 1
    at = (key * 0x9E3779B1) & mask
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + 1) & mask
    return at


@compiled
def search(
    seeds: np.ndarray,
    seed_costs: np.ndarray,
    actions: np.ndarray,
    costs: np.ndarray,
    counts: np.ndarray,
    soles: np.ndarray,
    legs: np.ndarray,
    arms: np.ndarray,
    discs: np.ndarray,
    drops: np.ndarray,
    extra: np.ndarray,
    tenths: np.ndarray,
    goal: tuple[int, int],
    figures: np.ndarray,
    epsilons: np.ndarray,
    budget: int,
) -> tuple[int, float, float, np.ndarray, int]:
    """ARA*: a first way quickly, then better ones while the budget of expansions lasts.

    Args:
        seeds: (n, 4) first states i, j, k and the foot that has stepped there; seed_costs: (n,) [s].
        actions: (2, bins, a, 3) moves (di, dj, dk) of the body when that foot steps next; costs (2, bins, a) [s];
            counts: (2, bins) how many there are.
        soles: (2, bins, 2) the foot's place in cells from the body's. drops: (ni, nj) where no sole may be.
        legs, arms, discs: see ``blocked_on_way``. extra: (ni, nj) cost of a step to there [s].
        tenths: of ``distance_map`` to the goal. goal: its i, j; its yaw is bin 0. figures: see ``bound``.
        epsilons: falling weights of the bound; the last should be 1. budget: expansions in all.

    Returns:
        FOUND with a proven optimum or bound, SPENT with or without a way, NOT_FOUND; cost [s]; proven bound on cost over
        optimum (inf without a way); states of the way (m, 4); expansions.
    """
    ni, nj = legs.shape
    bins = counts.shape[1]
    cap = 4096
    # Few expansions touch few states: the table grows by doubling.
    table = np.full(4 * cap, -1, np.int64)
    keys, parent, closed = np.empty(cap, np.int64), np.empty(cap, np.int64), np.empty(cap, np.int64)
    g, v, h = np.empty(cap), np.empty(cap), np.empty(cap)
    used, goal_node, expanded, proven = 0, -1, 0, np.inf
    heap = [(0.0, 0.0, -1)]
    heap.pop()
    for s in range(seeds.shape[0]):
        i, j, k, foot = seeds[s]
        key = ((i * nj + j) * bins + k) * 2 + foot
        at = _slot(table, keys, key)
        if table[at] < 0:
            table[at], keys[used], parent[used] = used, key, -1
            g[used], v[used], closed[used] = np.inf, np.inf, -1
            h[used] = bound(i, j, k, goal[0], goal[1], tenths, bins, figures)
            used += 1
        node = table[at]
        g[node] = min(g[node], seed_costs[s])
        if k == 0 and i == goal[0] and j == goal[1] and (goal_node < 0 or g[node] < g[goal_node]):
            goal_node = node
    for turn in range(epsilons.size):
        eps = epsilons[turn]
        heap.clear()
        for node in range(used):
            if g[node] < v[node]:
                heap.append((g[node] + eps * h[node], h[node], node))
        heapq.heapify(heap)
        while len(heap) > 0 and expanded < budget:
            f, _, node = heap[0]
            if goal_node >= 0 and g[goal_node] <= f:
                break
            heapq.heappop(heap)
            if closed[node] == turn or f > g[node] + eps * h[node] + 1e-9:
                continue
            closed[node], v[node] = turn, g[node]
            expanded += 1
            key = keys[node]
            foot, k = 1 - key % 2, key // 2 % bins
            j, i = key // (2 * bins) % nj, key // (2 * bins * nj)
            if used + counts[foot, k] >= cap:
                cap *= 2
                keys, parent, closed = _grown_i8(keys, cap), _grown_i8(parent, cap), _grown_i8(closed, cap)
                g, v, h = _grown_f8(g, cap), _grown_f8(v, cap), _grown_f8(h, cap)
                table = np.full(4 * cap, -1, np.int64)
                for n in range(used):
                    table[_slot(table, keys, keys[n])] = n
            for a in range(counts[foot, k]):
                di, dj, dk = actions[foot, k, a]
                ti, tj, tk = i + di, j + dj, (k + dk) % bins
                if ti < 0 or tj < 0 or ti >= ni or tj >= nj:
                    continue
                cost = g[node] + costs[foot, k, a] + extra[ti, tj]
                to = ((ti * nj + tj) * bins + tk) * 2 + foot
                at = _slot(table, keys, to)
                there = table[at]
                if there >= 0 and cost >= g[there] - 1e-12:
                    continue
                si, sj = ti + soles[foot, tk, 0], tj + soles[foot, tk, 1]
                if si < 0 or sj < 0 or si >= ni or sj >= nj or drops[si, sj]:
                    continue
                if blocked_on_way(i, j, k, di, dj, dk, legs, arms, discs):
                    continue
                if there < 0:
                    there = used
                    table[at], keys[there], v[there], closed[there] = there, to, np.inf, -1
                    h[there] = bound(ti, tj, tk, goal[0], goal[1], tenths, bins, figures)
                    used += 1
                g[there], parent[there] = cost, node
                if tk == 0 and ti == goal[0] and tj == goal[1] and (goal_node < 0 or cost < g[goal_node]):
                    goal_node = there
                if closed[there] != turn:
                    heapq.heappush(heap, (cost + eps * h[there], h[there], there))
        if goal_node < 0 or expanded >= budget:
            break
        proven = eps
    status = FOUND if goal_node >= 0 else (SPENT if expanded >= budget else NOT_FOUND)
    if goal_node < 0:
        return status, np.inf, np.inf, np.empty((0, 4), np.int64), expanded
    if proven > 1.0:
        least = np.inf
        for node in range(used):
            if g[node] < v[node]:
                least = min(least, g[node] + h[node])
        proven = max(1.0, min(proven, g[goal_node] / least))
    return status, g[goal_node], proven, _way(goal_node, keys, parent, nj, bins), expanded


@compiled
def _way(node: int, keys: np.ndarray, parent: np.ndarray, nj: int, bins: int) -> np.ndarray:
    """States (m, 4) from the first to the node: i, j, k, foot."""
    length, at = 0, node
    while at >= 0:
        length += 1
        at = parent[at]
    way = np.empty((length, 4), np.int64)
    at = node
    while at >= 0:
        length -= 1
        key = keys[at]
        way[length, 0], way[length, 1] = key // (2 * bins * nj), key // (2 * bins) % nj
        way[length, 2], way[length, 3] = key // 2 % bins, key % 2
        at = parent[at]
    return way


@compiled
def _grown_i8(values: np.ndarray, size: int) -> np.ndarray:
    bigger = np.empty(size, np.int64)
    bigger[: values.size] = values
    return bigger


@compiled
def _grown_f8(values: np.ndarray, size: int) -> np.ndarray:
    bigger = np.empty(size)
    bigger[: values.size] = values
    return bigger
