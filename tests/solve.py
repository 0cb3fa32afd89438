#!/usr/bin/env python3
"""Is the solution of Laplace's equation the same on the pieces of a mesh and on the whole?

  solve.py WHOLE.vtu PIECES.pvtu TOPOLOGY.json

All three are exports of one store with several sub-domains. Linear elements; the input surface has given values. On the pieces,
conjugate gradients run in a thread for each, which see each other's values only through the lists of the
topology; on the whole mesh, a direct solver. Exit code 0 when no value differs by more than 1e-10, and pyvista sees all pieces.
"""
import json
import os
import sys
import threading
import xml.etree.ElementTree

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg


def read(path):
    """Points, their ids, tetrahedra, and which points the input surface gives values to."""
    import meshio
    mesh, skin = meshio.read(path), meshio.read(path[:-4] + "_boundary.vtu")
    given = np.zeros(len(mesh.points), bool)
    triangles = skin.cells_dict["triangle"][np.ravel(skin.cell_data["input_id"][0]) >= 0]
    given[np.ravel(skin.point_data["mesh_vertex"])[triangles.ravel()]] = True
    return mesh.points, np.ravel(mesh.point_data["global_id"]), mesh.cells_dict["tetra"].astype(np.int64), given


def stiffness(points, tets):
    corners = points[tets]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6
    assert volume.min() > 0
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    gradients = np.concatenate([-inner.sum(1, keepdims=True), inner], 1)
    local = np.einsum("nik,njk,n->nij", gradients, gradients, volume)
    rows, columns = np.repeat(tets, 4, 1).ravel(), np.tile(tets, (1, 4)).ravel()
    return sp.csr_matrix((local.ravel(), (rows, columns)), shape=(len(points),) * 2)


def boundary_value(points):
    x, y, z = points.T
    return np.exp(x) * np.sin(y) + z * z


def solve_whole(path):
    points, ids, tets, given = read(path)
    matrix, values = stiffness(points, tets), boundary_value(points)
    free = ~given
    load = -matrix[free][:, given] @ values[given]
    values[free] = sp.linalg.spsolve(matrix[free][:, free].tocsc(), load)
    return dict(zip(ids.tolist(), values))


class Piece(threading.Thread):
    """One sub-domain; `post[a, b]` is what a tells b, in the order of their list."""

    def __init__(self, rank, path, shared, post, sums, gate):
        super().__init__(daemon=True)
        self.rank, self.path, self.shared, self.post, self.sums, self.gate = rank, path, shared, post, sums, gate
        self.values = None

    def exchange(self, mine):
        """Adds what the others have at shared vertices."""
        for other, numbers in self.shared.items():
            self.post[self.rank, other] = mine[numbers]
        self.gate.wait()
        total = mine.copy()
        for other, numbers in self.shared.items():
            total[numbers] += self.post[other, self.rank]
        self.gate.wait()
        return total

    def dot(self, a, b):
        """Over all pieces; shared vertices count once."""
        self.sums[self.rank] = float((a * b * self.weight).sum())
        self.gate.wait()
        total = sum(self.sums[rank] for rank in sorted(self.sums))
        self.gate.wait()
        return total

    def run(self):
        points, self.ids, tets, given = read(self.path)
        free = self.exchange(given.astype(float)) == 0
        self.weight = 1 / self.exchange(np.ones(len(points)))
        matrix = stiffness(points, tets)
        values = np.where(free, 0, boundary_value(points))
        rest = np.where(free, -self.exchange(matrix @ values), 0)
        scale = 1 / self.exchange(matrix.diagonal())
        step = scale * rest
        size = first = self.dot(rest, step)
        for _ in range(5000):
            if size <= 1e-28 * first:
                break
            image = np.where(free, self.exchange(matrix @ step), 0)
            length = size / self.dot(step, image)
            values = values + length * step
            rest = rest - length * image
            size, before = self.dot(rest, scale * rest), size
            step = scale * rest + size / before * step
        else:
            raise RuntimeError("conjugate gradients did not converge")
        self.values = values


def solve_pieces(pvtu, topology):
    names = [p.get("Source") for p in xml.etree.ElementTree.parse(pvtu).iter("Piece")]
    shared = {s["id"]: {} for s in topology["subdomains"]}
    for pair in topology["pairs"]:
        low, high = pair["vertices"]
        shared[pair["low"]][pair["high"]] = np.array(low)
        shared[pair["high"]][pair["low"]] = np.array(high)
    post, sums, gate = {}, {}, threading.Barrier(len(names))
    pieces = [Piece(rank, os.path.join(os.path.dirname(pvtu), name), shared[rank], post, sums, gate)
              for rank, name in enumerate(names)]
    for piece in pieces:
        piece.start()
    for piece in pieces:
        piece.join()
    return pieces


def main():
    import meshio  # noqa: F401  (not from several threads at once)
    import pyvista
    whole, pvtu, topology = sys.argv[1:4]
    topology = json.load(open(topology))
    expected = solve_whole(whole)
    pieces = solve_pieces(pvtu, topology)
    seen = pyvista.get_reader(pvtu).read()
    tets = sum(s["tets"] for s in topology["subdomains"])
    assert seen.n_cells == tets, f"pyvista sees {seen.n_cells} of {tets} tetrahedra"
    assert len(np.unique(seen.cell_data["subdomain"])) == len(pieces)
    for pair in topology["pairs"]:
        low, high = (pieces[pair[side]].ids[numbers] for side, numbers in zip(("low", "high"), pair["vertices"]))
        assert np.array_equal(low, high), f"the list of {pair['low']} and {pair['high']} mixes vertices up"
    worst, found = 0.0, set()
    for piece in pieces:
        for vertex, value in zip(piece.ids.tolist(), piece.values):
            worst = max(worst, abs(value - expected[vertex]))
            found.add(vertex)
    assert len(found) == len(expected)
    print(f"{len(pieces)} pieces, {len(found)} vertices: greatest difference {worst:.2e}")
    sys.exit(int(worst > 1e-10))


if __name__ == "__main__":
    main()
