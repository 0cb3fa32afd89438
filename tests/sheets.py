#!/usr/bin/env python3
"""Is a mesh conforming, of the right volume, and has it every triangle of a sheet, every edge and every point inside?

  sheets.py MESH.mesh SHELL.obj SHEETS.obj [WIRES.obj]

MESH.mesh: the export of a mesh of SHELL.obj with SHEETS.obj embedded, all of its inside filled. Reads both formats by itself. Checked:
tetrahedra are positive (rationals decide where doubles cannot); a face has one tetrahedron, or two that see it from opposite sides;
the faces with one are the triangles of the shell, bit for bit; each triangle of a sheet is a face of two; each is listed among the
triangles of the file; each line of WIRES.obj is an edge of a tetrahedron and listed with a reference of its own group, each of its
points a vertex of one and required, and no other is listed; volumes add up to what the shell encloses. Exit code 0 when all of it holds.
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
    edges = block("Edges", 3, np.int64) if "Edges" in at else np.zeros((0, 3), np.int64)
    required = block("RequiredVertices", 1, np.int64)[:, 0] - 1 if "RequiredVertices" in at else np.zeros(0, np.int64)
    references = block("Vertices", 4, float)[:, 3].astype(int)
    return points, triangles[:, :3] - 1, triangles[:, 3], tets[:, :4] - 1, (edges, required, references)


def read_obj(path):
    points, faces, lines, marks, group = [], [], [], [], ""
    for line in open(path):
        word = line.split()
        if word and word[0] == "v":
            points.append([float(x) for x in word[1:4]])
        elif word and word[0] == "g":
            group = line[1:].strip()
        elif word and word[0] == "l":
            ends = [int(v) - 1 for v in word[1:]]
            lines += [(a, b, group) for a, b in zip(ends, ends[1:])]
        elif word and word[0] == "p":
            marks += [(int(v) - 1, group) for v in word[1:]]
        elif word and word[0] == "f":
            faces.append([int(v.split("/")[0]) - 1 for v in word[1:4]])
    return np.array(points), np.array(faces, np.int64), lines, marks


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
    points, triangles, labels, tets, (edges, required, references) = read_mesh(mesh)
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
        own, found, *_ = read_obj(surface)
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
    wires = sys.argv[4:5]
    at, _, lines, marks = read_obj(wires[0]) if wires else ([], [], [], [])
    number = [place.get((p + 0.0).tobytes(), -1) for p in at]
    expect(-1 not in number, f"{number.count(-1)} vertices of edges and points are not in the mesh")
    pairs = np.sort(np.concatenate([tets[:, [i, j]] for i in range(4) for j in range(i)]), axis=1)
    has_edge = set(map(tuple, pairs.tolist()))
    lost = [w for w in lines if tuple(sorted(number[v] for v in w[:2])) not in has_edge]
    expect(not lost, f"{len(lost)} of {len(lines)} edges inside are no edges of tetrahedra")
    in_tets = set(tets.ravel().tolist())
    lost = [v for v, _ in marks if number[v] not in in_tets]
    expect(not lost, f"{len(lost)} of {len(marks)} points inside are no vertices of tetrahedra")
    listed = {tuple(sorted((a - 1, b - 1))): r for a, b, r in edges.tolist()}
    wanted = {tuple(sorted(number[v] for v in w[:2])): w[2] for w in lines}
    expect(listed.keys() == wanted.keys(), "the edges of the file are not those inside")
    expect(set(required.tolist()) == {number[v] for v, _ in marks}, "the required vertices of the file are not the points inside")
    names = {}
    for kind, pairs in ((1, [(listed.get(k), n) for k, n in wanted.items()]), (0, [(references[number[v]], n) for v, n in marks])):
        for reference, name in pairs:
            expect(names.setdefault((kind, name), reference) == reference, f"{name} has several references")
    expect(len(set(names.values())) == len(names) and None not in names.values() and 0 not in names.values(), "names share a reference")
    for what in wrong[:20]:
        print("sheets.py:", what)
    print(f"{len(tets)} tetrahedra, {len(outer)} triangles outside, {len(inner)} of sheets, {len(of_sheets)} labels, {len(lines)} edges and {len(marks)} points: {'wrong' if wrong else 'right'}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
