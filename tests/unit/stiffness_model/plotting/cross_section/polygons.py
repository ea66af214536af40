"""Distances and intersections of polygons by elementary geometry, independent of the code under test."""

from __future__ import annotations

import numpy as np


def distances(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Distance of each point (n, 2) from a closed polygon (m, 2)."""
    start, along = polygon, np.roll(polygon, -1, axis=0) - polygon
    way = points[:, None] - start
    share = np.clip((way * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return np.hypot(*np.moveaxis(way - share[..., None] * along, -1, 0)).min(axis=1)


def crossings(polygon: np.ndarray) -> int:
    """Number of pairs of edges, not neighbouring each other, that intersect."""
    a, b = polygon, np.roll(polygon, -1, axis=0)

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        """On which side of p -> q (each) r (all) lies."""
        d, way = (q - p)[:, None], r[None] - p[:, None]
        return np.sign(d[..., 0] * way[..., 1] - d[..., 1] * way[..., 0])

    parts = side(a, b, a) * side(a, b, b) <= 0
    meet = parts & parts.T
    n = len(polygon)
    gap = np.abs(np.arange(n)[:, None] - np.arange(n))
    return int(meet[(gap > 1) & (gap < n - 1)].sum()) // 2


def area(polygon: np.ndarray) -> float:
    """Signed area, positive counter-clockwise."""
    x, y = polygon.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
