"""What guides and bounds a footstep search, compiled: distance maps, counts of steps on empty ground, a likely way.

The distance map is Dijkstra's with Dial's buckets (Comm. ACM 12 (1969), 632-633).
"""

from __future__ import annotations

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
