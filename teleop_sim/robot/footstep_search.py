"""Footstep search, compiled: an anytime A* over a lattice of body poses, and what guides and bounds it.

Rounds of weighted A* that keep what they have found, then A* itself, as ARA* does (Likhachev, Gordon, Thrun, ARA*:
Anytime A* with provable bounds on sub-optimality, NIPS 2003). The weighted rounds follow a guess that may be too long,
so the proven bound comes from the admissible one alone. The distance map is Dijkstra's with Dial's buckets (Comm. ACM
12 (1969), 632-633). Budgets are counted in expansions, never in seconds: a plan is a function of its inputs.
"""

from __future__ import annotations

import heapq

import numpy as np

from teleop_sim.robot.law_math import compiled

STRAIGHT, DIAGONAL = 10, 14
"""Costs of a step in the distance map; 14 is less than 10 times the root of 2, so distances are never too long."""

OCTILE = 0.9238795325112867
"""Cosine of 22.5 degrees: a straight way is at least this share of the shortest eight-neighbour way."""


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
def free_steps(back: np.ndarray, counts: np.ndarray, reach: int, longest: float) -> np.ndarray:
    """Fewest steps (2, n, n, bins) on empty ground from every state to (0, 0, 0) with either foot, n = 2 reach + 1.

    Breadth first from the goal. Args: back: (2, bins, a, 3) moves that lead back from where that foot has stepped, and
    the yaw [bins] there; counts: (2, bins). reach: [cells]. longest: move [cells]. States not reached get 0. A way
    that leaves the square may be shorter than those in it: counts are cut to what such a way takes at least.
    """
    bins, n = counts.shape[1], 2 * reach + 1
    table = np.zeros((2, n, n, bins), np.uint8)
    queue = np.empty(2 * n * n * bins, np.int32)
    first, last = 0, 0
    for foot in range(2):
        queue[last] = ((foot * n + reach) * n + reach) * bins
        last += 1
    steps = 0
    while first < last and steps < 254:
        steps += 1
        stop = last
        while first < stop:
            state = queue[first]
            first += 1
            k, j, i, foot = state % bins, state // bins % n, state // (bins * n) % n, state // (bins * n * n)
            for a in range(counts[foot, k]):
                ti, tj, tk = i + back[foot, k, a, 0], j + back[foot, k, a, 1], back[foot, k, a, 2]
                if ti < 0 or tj < 0 or ti >= n or tj >= n or table[1 - foot, ti, tj, tk] > 0:
                    continue
                if ti == reach and tj == reach and tk == 0:
                    continue
                table[1 - foot, ti, tj, tk] = steps
                queue[last] = (((1 - foot) * n + ti) * n + tj) * bins + tk
                last += 1
    for i in range(n):
        for j in range(n):
            out = int((2 * reach + 1 - max(abs(i - reach), abs(j - reach))) / longest)
            for k in range(bins):
                for foot in range(2):
                    table[foot, i, j, k] = min(table[foot, i, j, k], out)
    return table


@compiled
def bound(
    i: int,
    j: int,
    k: int,
    foot: int,
    goal: tuple[int, int],
    tenths: np.ndarray,
    free: np.ndarray,
    figures: np.ndarray,
) -> float:
    """Least cost [s] from a state to the goal (i, j of ``goal``, yaw 0, either foot); never more than the true one.

    ``tenths``: of ``distance_map``. ``free``: of ``free_steps``. ``figures``: time of a step [s], its longest move
    [cells] and turn [bins], cost of a cell [s] and of a bin [s].
    """
    step_s, longest, widest, cell_s, bin_s = figures
    bins, reach = free.shape[3], free.shape[1] // 2
    di, dj = i - goal[0], j - goal[1]
    straight = max(np.sqrt(di * di + dj * dj), OCTILE * 0.1 * tenths[i, j])
    turn = min(k, bins - k)
    steps = np.ceil(max(straight / longest, turn / widest) - 1e-9)
    if abs(di) <= reach and abs(dj) <= reach:
        steps = max(steps, float(free[foot, di + reach, dj + reach, k]))
    return float(steps * step_s + straight * cell_s + turn * bin_s)


@compiled
def corners(tenths: np.ndarray, blocked: np.ndarray, i1: int, j1: int, i0: int, j0: int) -> np.ndarray:
    """Corners (m, 2) of a way from (i1, j1) to (i0, j0): down the distance map, then straightened as far as cells see
    each other. Without a way in the map it is the straight line.
    """
    ni, nj = blocked.shape
    cells = np.empty((ni * nj, 2), np.int64)
    cells[0], n = (i1, j1), 1
    while tenths[i1, j1] > 0:
        i, j = cells[n - 1]
        best = (i, j)
        for di in range(-1, 2):
            for dj in range(-1, 2):
                a, b = i + di, j + dj
                if 0 <= a < ni and 0 <= b < nj and not blocked[a, b] and tenths[a, b] < tenths[best[0], best[1]]:
                    best = (a, b)
        cells[n] = best
        n += 1
        if best == (i0, j0) or best == (i, j):
            break
    kept = np.empty((n + 1, 2), np.int64)
    kept[0], m, at = cells[0], 1, 0
    while at < n - 1:
        to = n - 1
        while to > at + 1 and not _sees(blocked, cells[at], cells[to]):
            to -= 1
        kept[m], at = cells[to], to
        m += 1
    if kept[m - 1, 0] != i0 or kept[m - 1, 1] != j0:
        kept[m] = (i0, j0)
        m += 1
    return kept[:m].copy()


@compiled
def _sees(blocked: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    n = max(abs(b[0] - a[0]), abs(b[1] - a[1]))
    for s in range(1, n):
        if blocked[
            int(np.floor(a[0] + (b[0] - a[0]) * s / n + 0.5)), int(np.floor(a[1] + (b[1] - a[1]) * s / n + 0.5))
        ]:
            return False
    return True


@compiled
def guess(i: int, j: int, k: int, way: np.ndarray, after: np.ndarray, turning: np.ndarray, longest: float) -> float:
    """Steps that are probably left: along the nearest piece of the way, and to face it. No bound, but a good guide.

    ``way``: corners (m, 2). ``after``: (m,) steps from each corner on. ``turning``: (bins,) steps that a heading costs
    which is so many bins off.
    """
    bins, best, least = turning.size, 0.0, np.inf
    for c in range(way.shape[0] - 1):
        ux, uy = float(way[c + 1, 0] - way[c, 0]), float(way[c + 1, 1] - way[c, 1])
        px, py = float(i - way[c, 0]), float(j - way[c, 1])
        share = min(1.0, max(0.0, (px * ux + py * uy) / (ux * ux + uy * uy)))
        off = np.hypot(px - share * ux, py - share * uy)
        if off > least:
            continue
        least = off
        dx, dy = float(way[c + 1, 0] - i), float(way[c + 1, 1] - j)
        left = np.hypot(dx, dy)
        best = left / longest + after[c + 1]
        if left > 0.0:
            heading = int(np.floor(np.arctan2(dy, dx) * bins / (2.0 * np.pi) + 0.5))
            # Near a corner the direction to it says little.
            best += turning[(k - heading) % bins] * min(1.0, left / longest)
    return best


@compiled
def _slot(table: np.ndarray, keys: np.ndarray, key: int) -> int:
    """Where in the hash table a key is or belongs."""
    mask = table.size - 1
    at = (key * 0x9E3779B1) & mask
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + 1) & mask
    return at


@compiled
def _hashed(keys: np.ndarray, used: int, size: int) -> np.ndarray:
    """A hash table of so many keys."""
    table = np.full(size, -1, np.int64)
    for n in range(used):
        table[_slot(table, keys, keys[n])] = n
    return table


@compiled
def _queue(
    g: np.ndarray, v: np.ndarray, h: np.ndarray, hint: np.ndarray, used: int, best: float, weight: float
) -> list[tuple[float, float, int]]:
    """States to look at in a new round: those that became cheaper since last expanded and may still serve."""
    heap = [(np.inf, np.inf, used)]
    for node in range(used):
        if g[node] < v[node] and g[node] + h[node] < best:
            key_s = g[node] + (weight * hint[node] if weight > 0.0 else h[node])
            heap.append((key_s, h[node], node))
    heapq.heapify(heap)
    return heap


@compiled
def _least(g: np.ndarray, v: np.ndarray, h: np.ndarray, used: int, best: float) -> float:
    """What every way costs at least, by the states still to be expanded."""
    least = best
    for node in range(used):
        if g[node] < v[node]:
            least = min(least, g[node] + h[node])
    return least


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
    free: np.ndarray,
    goal: tuple[int, int],
    figures: np.ndarray,
    way: np.ndarray,
    after: np.ndarray,
    turning: np.ndarray,
    weights: np.ndarray,
    budget: int,
) -> tuple[float, float, np.ndarray, int]:
    """Anytime search: first ways by guess, then the best one by bound, while the budget of expansions lasts.

    Args:
        seeds: (n, 4) first states i, j, k and the foot that has stepped there; seed_costs: (n,) [s].
        actions: (2, bins, a, 3) moves (di, dj, dk) of the body when that foot steps next; costs (2, bins, a) [s];
            counts: (2, bins) how many there are.
        soles: (2, bins, 2) the foot's place in cells from the body's. drops: (ni, nj) where no sole may be.
        legs, arms, discs: see ``blocked_on_way``. extra: (ni, nj) cost of a step to there [s].
        tenths, free, figures: see ``bound``. goal: its i, j; its yaw is bin 0.
        way, after, turning: see ``guess``.
        weights: of the guess in successive rounds; in the last round, weight 0, the bound takes its place.
        budget: expansions in all.

    Returns:
        Cost [s], inf without a way; proven lower bound of it [s], inf if it is proven that there is no way; states of
        the way (m, 4); expansions.
    """
    ni, nj = legs.shape
    bins, step_s = counts.shape[1], figures[0]
    cap = 4096
    # Few expansions touch few states: the tables grow by doubling.
    table = np.full(4 * cap, -1, np.int64)
    keys, parent, closed = np.empty(cap, np.int64), np.empty(cap, np.int64), np.empty(cap, np.int64)
    g, v, h, hint = np.empty(cap), np.empty(cap), np.empty(cap), np.empty(cap)
    used, goal_node, expanded, best = 0, -1, 0, np.inf
    for s in range(seeds.shape[0]):
        i, j, k, foot = seeds[s]
        key = ((i * nj + j) * bins + k) * 2 + foot
        at = _slot(table, keys, key)
        if table[at] < 0:
            table[at], keys[used], parent[used] = used, key, -1
            g[used], v[used], closed[used] = np.inf, np.inf, -1
            h[used] = bound(i, j, k, foot, goal, tenths, free, figures)
            hint[used] = step_s * guess(i, j, k, way, after, turning, figures[1])
            used += 1
        node = table[at]
        g[node] = min(g[node], seed_costs[s])
        if k == 0 and i == goal[0] and j == goal[1] and g[node] < best:
            goal_node, best = node, g[node]
    for turn in range(weights.size):
        weight = weights[turn]
        heap = _queue(g, v, h, hint, used, best, weight)
        while expanded < budget:
            f, _, node = heapq.heappop(heap)
            if f >= best or f == np.inf:
                break
            if closed[node] == turn or g[node] >= v[node]:
                continue
            closed[node], v[node] = turn, g[node]
            expanded += 1
            key = keys[node]
            foot, k = 1 - key % 2, key // 2 % bins
            j, i = key // (2 * bins) % nj, key // (2 * bins * nj)
            if used + counts[foot, k] >= cap:
                cap *= 2
                keys, parent, closed = _grown_i8(keys, cap), _grown_i8(parent, cap), _grown_i8(closed, cap)
                g, v, h, hint = _grown_f8(g, cap), _grown_f8(v, cap), _grown_f8(h, cap), _grown_f8(hint, cap)
                table = _hashed(keys, used, 4 * cap)
            for a in range(counts[foot, k]):
                di, dj, dk = actions[foot, k, a]
                ti, tj, tk = i + di, j + dj, (k + dk) % bins
                si, sj = ti + soles[foot, tk, 0], tj + soles[foot, tk, 1]
                if (
                    ti < 0
                    or tj < 0
                    or ti >= ni
                    or tj >= nj
                    or si < 0
                    or sj < 0
                    or si >= ni
                    or sj >= nj
                    or drops[si, sj]
                ):
                    continue
                cost = g[node] + costs[foot, k, a] + extra[ti, tj]
                to = ((ti * nj + tj) * bins + tk) * 2 + foot
                at = _slot(table, keys, to)
                there = table[at]
                if there >= 0 and cost >= g[there] - 1e-12:
                    continue
                if there < 0:
                    least = bound(ti, tj, tk, foot, goal, tenths, free, figures)
                    if cost + least >= best or blocked_on_way(i, j, k, di, dj, dk, legs, arms, discs):
                        continue
                    there = used
                    table[at], keys[there], v[there], closed[there] = there, to, np.inf, -1
                    h[there], hint[there] = least, step_s * guess(ti, tj, tk, way, after, turning, figures[1])
                    used += 1
                elif cost + h[there] >= best or blocked_on_way(i, j, k, di, dj, dk, legs, arms, discs):
                    continue
                g[there], parent[there] = cost, node
                if tk == 0 and ti == goal[0] and tj == goal[1] and cost < best:
                    goal_node, best = there, cost
                if closed[there] != turn:
                    key_s = cost + (weight * hint[there] if weight > 0.0 else h[there])
                    heapq.heappush(heap, (key_s, h[there], there))
        if expanded >= budget:
            break
    least = _least(g, v, h, used, best)
    if goal_node < 0:
        return np.inf, least, np.empty((0, 4), np.int64), expanded
    return best, least, _way(goal_node, keys, parent, nj, bins), expanded


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
