"""Poisson's equation with linear elements, solved by conjugate gradients: the sub-command `peers.py poisson` uses it.

The preconditioner is the diagonal, which mends the bad conditioning of flat tetrahedra only in part.
"""
import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from quality import FACES

ITERATIONS_MAX = 100_000


def stiffness(points, tets):
    """The matrix of linear elements and the right side for a source of 1, over all vertices."""
    p = points[tets]
    edges = p[:, 1:] - p[:, :1]
    six = np.linalg.det(edges)
    # Gradients of the barycentric coordinates: rows of the inverse, and the first so that their sum is zero.
    inverse = np.stack([np.cross(edges[:, (i + 1) % 3], edges[:, (i + 2) % 3]) for i in range(3)], 1) / six[:, None, None]
    gradients = np.concatenate([-inverse.sum(1, keepdims=True), inverse], 1)
    local = np.einsum("tid,tjd->tij", gradients, gradients) * (np.abs(six) / 6)[:, None, None]
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, (1, 4)).ravel()
    matrix = scipy.sparse.csr_matrix((local.ravel(), (rows, columns)), shape=(len(points),) * 2)
    right = np.zeros(len(points))
    np.add.at(right, tets, (np.abs(six) / 24)[:, None])
    return matrix, right


def hull_vertices(tets):
    """Vertices of faces that one tetrahedron has."""
    faces = np.sort(tets[:, FACES].reshape(-1, 3), axis=1)
    found, count = np.unique(faces, axis=0, return_counts=True)
    return np.unique(found[count == 1])


def solve(points, tets):
    """Unknowns, iterations (None where they did not end) and the greatest value."""
    used, number = np.unique(tets, return_inverse=True)
    points, tets = points[used], number.reshape(-1, 4)
    matrix, right = stiffness(points, tets)
    inside = np.setdiff1d(np.arange(len(points)), hull_vertices(tets))
    if not len(inside):
        return 0, 0, 0.0
    matrix, right = matrix[inside][:, inside], right[inside]
    diagonal = scipy.sparse.diags(1 / matrix.diagonal())
    n_iterations = [0]

    def count(_):
        n_iterations[0] += 1

    u, failed = scipy.sparse.linalg.cg(matrix, right, rtol=1e-8, maxiter=ITERATIONS_MAX, M=diagonal, callback=count)
    return len(inside), None if failed else n_iterations[0], float(u.max())
