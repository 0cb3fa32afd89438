"""An adaptive loop: solve, estimate the error, mesh again where it is large.

    python poisson.py FOLDER [PICTURE]

-Δu = f in the unit cube with linear elements; u is a steep bump away from the walls, so the true error is known. The estimate is not
its: in each tetrahedron, how far the gradient is from the mean of those around its vertices (Zienkiewicz and Zhu). Each round halves
lengths at most where the estimate is above its target, and lets them grow where it is below. Prints tetrahedra, estimated and true
error in the energy norm; exit code 0 when the last true error is below half of the first.
"""

from __future__ import annotations

import os
import sys

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix  # type: ignore[import-untyped]
from scipy.sparse.linalg import cg  # type: ignore[import-untyped]

import tetdb

Array = npt.NDArray[np.float64]
MIDDLE, WIDTH = np.array([0.35, 0.45, 0.55]), 0.08


def exact(points: Array) -> tuple[Array, Array, Array]:
    """The bump, its gradient, and minus its Laplacian."""
    away = points - MIDDLE
    square = (away**2).sum(axis=-1) / WIDTH**2
    u = np.exp(-square / 2)
    return u, -away / WIDTH**2 * u[..., None], (3 - square) / WIDTH**2 * u


def solve(points: Array, tets: npt.NDArray[np.int32]) -> tuple[Array, Array, Array]:
    """The solution at the points, its gradient in each tetrahedron, and volumes."""
    corners = points[tets]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.linalg.det(edges) / 6
    slopes = np.linalg.inv(edges)
    slopes = np.concatenate([-slopes.sum(axis=2, keepdims=True), slopes], axis=2)
    local = np.einsum("tia,tib,t->tab", slopes, slopes, volumes)
    n = len(points)
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, 4).ravel()
    stiffness = coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
    load = np.repeat(exact(corners.mean(axis=1))[2] * volumes / 4, 4)
    right = np.bincount(tets.ravel(), load, n)
    wall = ((points == 0) | (points == 1)).any(axis=1)
    u = np.where(wall, exact(points)[0], 0.0)
    inner = np.flatnonzero(~wall)
    matrix = stiffness[inner]
    u[inner], failed = cg(matrix[:, inner], right[inner] - matrix @ u, rtol=1e-8)
    assert not failed
    return u, np.einsum("tia,ta->ti", slopes, u[tets]), volumes


def estimated(tets: npt.NDArray[np.int32], gradient: Array, volumes: Array, n: int) -> Array:
    """The square of the error in each tetrahedron, from gradients averaged at vertices."""
    weight = np.bincount(tets.ravel(), np.repeat(volumes, 4), n)
    mean = [np.bincount(tets.ravel(), np.repeat(volumes * g, 4), n) / weight for g in gradient.T]
    smooth = np.stack(mean, axis=1)[tets].mean(axis=1)
    return np.asarray(((smooth - gradient) ** 2).sum(axis=1) * volumes)


def main(folder: str, picture: str | None = None) -> int:
    errors = []
    path = os.path.join(folder, "poisson.tetdb")
    with tetdb.mesh(tetdb.sample("box,h=0.15"), path, hsiz=0.15) as store:
        for step in range(5):
            part = store.subdomain(0)
            _, gradient, volumes = solve(part.points, part.tets)
            square = estimated(part.tets, gradient, volumes, len(part.points))
            corners = part.points[part.tets]
            truth = ((exact(corners.mean(axis=1))[1] - gradient) ** 2).sum(axis=1) * volumes
            errors.append(float(np.sqrt(truth.sum())))
            print(f"{store.n_tets:8} tetrahedra, error {np.sqrt(square.sum()):.4f} estimated, {errors[-1]:.4f} true")
            if step < 4:
                # The same error in all, and in all together six tenths of what it is; h^5 of the square in one follows from h.
                target = 0.36 * square.sum() / len(square)
                factor = np.clip((target / np.maximum(square, 1e-300)) ** 0.2, 0.5, 1.3)
                lengths = (6 * np.sqrt(2) * volumes) ** (1 / 3) * factor
                store.resaturate([0], sizes=np.minimum(lengths, 0.15))
        if picture:
            plane = (MIDDLE, (0, -1, 0))
            store.snapshot(picture, color="size", plane=plane, pixels=(480, 400))
    return 0 if errors[-1] < errors[0] / 2 else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
