#!/usr/bin/env python3
"""Is a mesh conforming, of the right volume, and has every triangle of a sheet a tetrahedron on both sides?

  sheets.py MESH.mesh SHELL.obj SHEETS.obj

MESH.mesh: the export of a mesh of SHELL.obj with SHEETS.obj embedded, all of its inside filled. Reads both formats by itself. Checked:
tetrahedra are positive (rationals decide where doubles cannot); a face has one tetrahedron, or two that see it from opposite sides;
the faces with one are the triangles of the shell, bit for bit; each triangle of a sheet is a face of two; each is listed among the
triangles of the file; volumes add up to what the shell encloses. Exit code 0 when all of it holds.
"""
import sys
from fractions import Fraction

import numpy as np

# Rounding of a determinant of differences, relative to the product of their lengths.
BOUND = 1e-14


def read_mesh(path):
    words = open(path).read().split()
    at = {w: i for i, w in enumerate(words) if w[0].isalpha()}

    def block(name, width, kind):
        start = at[name]
        n = int(words[start + 1])
        return np.array(words[start + 2:start + 2 + n * width], dtype=kind).reshape(n, width)
    points = block("Vertices", 4, float)[:, :3]
    triangles = block("Triangles", 4, np.int64)
    tets = block("Tetrahedra", 5, np.int64)
    return points, triangles[:, :3] - 1, triangles[:, 3], tets[:, :4] - 1


def read_obj(path):
    points, faces = [], []
    for line in open(path):
        word = line.split()
        if word and word[0] == "v":
            points.append([float(x) for x in word[1:4]])
        elif word and word[0] == "f":
            faces.append([int(v.split("/")[0]) - 1 for v in word[1:4]])
    return np.array(points), np.array(faces, np.int64)


def volume6(points, tets):
    """Six times each volume; its sign is exact."""
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    u, v, w = b - a, c - a, d - a
    value = np.einsum("ij,ij->i", u, np.cross(v, w))
    size = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1) * np.linalg.norm(w, axis=1)
    for i in np.flatnonzero(np.abs(value) <= BOUND * size):
        p = [[Fraction(x) for x in points[t]] for t in tets[i]]
        (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = ([q - r for q, r in zip(p[k], p[0])] for k in (1, 2, 3))
        exact = x1 * (y2 * z3 - z2 * y3) - y1 * (x2 * z3 - z2 * x3) + z1 * (x2 * y3 - y2 * x3)
        value[i] = np.sign(float(exact)) * max(abs(float(exact)), 5e-324) if exact else 0.0
    return value


def main():
    mesh, shell, sheets = sys.argv[1:4]
    points, triangles, labels, tets = read_mesh(mesh)
    wrong = []

    def expect(holds, what):
        if not holds:
            wrong.append(what)
    six = volume6(points, tets)
    expect((six > 0).all(), f"{(six <= 0).sum()} tetrahedra are not positive")
    # Faces as seen from outside; a rotation to the smallest vertex first keeps the direction.
    faces = np.concatenate([tets[:, f] for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    sides = {}
    for face in map(tuple, faces.tolist()):
        i = face.index(min(face))
        face = face[i:] + face[:i]
        expect(face not in sides, f"two tetrahedra on one side of {face}")
        sides[face] = True
    key = {}
    for a, b, c in sides:
        k = (a, min(b, c), max(b, c))
        key[k] = key.get(k, 0) + 1
    place = {p.tobytes(): i for i, p in enumerate(points + 0.0)}

    def known(surface, name):
        own, found = read_obj(surface)
        numbers = [place.get((p + 0.0).tobytes(), -1) for p in own]
        expect(-1 not in numbers, f"{numbers.count(-1)} vertices of {name} are not in the mesh")
        return own, found, [tuple(sorted(numbers[v] for v in t)) for t in found]
    own, found, outer = known(shell, "the shell")
    _, _, inner = known(sheets, "the sheets")
    skin = {k for k, n in key.items() if n == 1}
    expect(skin == set(outer), f"{len(skin ^ set(outer))} faces are of the boundary or of the shell alone")
    lost = [t for t in inner if key.get(t) != 2]
    expect(not lost, f"{len(lost)} of {len(inner)} triangles of sheets have not two tetrahedra")
    listed = {tuple(sorted(t)) for t in triangles.tolist()}
    expect(listed == set(outer) | set(inner), "the triangles of the file are not those of shell and sheets")
    of_shell = {r for t, r in zip(triangles.tolist(), labels) if tuple(sorted(t)) in skin}
    of_sheets = {r for t, r in zip(triangles.tolist(), labels) if tuple(sorted(t)) not in skin}
    expect(not of_shell & of_sheets, "a label is of the shell and of a sheet")
    a, b, c = (own[found[:, i]] for i in range(3))
    enclosed = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    total = six.sum() / 6
    expect(abs(total - enclosed) <= 1e-9 * abs(enclosed), f"volume {total}, the shell encloses {enclosed}")
    for what in wrong[:20]:
        print("sheets.py:", what)
    print(f"{len(tets)} tetrahedra, {len(outer)} triangles outside, {len(inner)} of sheets, {len(of_sheets)} labels: {'wrong' if wrong else 'right'}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
