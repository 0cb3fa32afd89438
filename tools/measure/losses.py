#!/usr/bin/env python3
"""Does a reader lose anything in silence?

  losses.py TETDB [N] [--seed S] [--keep FOLDER] [--collection FOLDER]

TETDB: the program. N: variants of each format (20; a thorough search takes 200). Each variant is a small body in a file with random odd but
legal details: comments, line ends, encodings, further columns, quadrilaterals, polygons, groups, unused vertices, faces before vertices, edges
and solid elements beside the faces. What the file holds is known: triangles after polygons are cut, labels, bounds, volume. `tetdb check`
must find the same, and name in a note what it leaves out, or refuse the file; anything else is a silent loss. `--keep` keeps the
files with losses. `--collection` compares the files of a folder with meshio or trimesh, where these read them. Writers: this script, and meshio,
trimesh, gmsh and VTK where they are installed. Exit code 1 if anything was lost in silence.
"""
import argparse
import collections
import contextlib
import glob
import gzip
import io
import itertools
import json
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile

import numpy as np

THIN, SOLID, CURVED = r"(lines|edges|beams|points)\b.* left out", r"(solid elements|tetrahedra|hexahedra).* left out", r"curved faces?"
NAMES = ["wall", "Wall 2", "Außenwänd", "Außenwönd", "côté-1", "in.let"]


class Body:
    """Corners, faces of any number of them with labels from 0, and the volume as hexahedra."""

    def __init__(self, points, faces, labels, hexahedra=()):
        self.points, self.faces, self.labels, self.hexahedra = np.array(points, float), faces, labels, list(hexahedra)

    def cut(self, most):
        """Faces of at most `most` corners: fans from the first one, which sees all others."""
        cut = []
        for face, label in zip(self.faces, self.labels):
            parts = [face] if len(face) <= most else [[face[0], face[k], face[k + 1]] for k in range(1, len(face) - 1)]
            cut += [(part, label) for part in parts]
        return cut


def block(x):
    """Corners of a cell of the unit grid."""
    return [(x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0), (x, 1, 0)]


def bodies(rng):
    box = block(0) + [(x, y, 1) for x, y, _ in block(0)]
    sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    ell = [(1, 1), (0, 1), (0, 0), (2, 0), (2, 2), (1, 2)]
    prism = [(x, y, z) for z in (0, 1) for x, y in ell]
    caps = [[0, 5, 4, 3, 2, 1], [6, 7, 8, 9, 10, 11]] + [[k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6] for k in range(6)]
    body = rng.choice([
        lambda: Body(box, sides, [rng.randrange(3) for _ in sides], [range(8)]),
        lambda: Body(prism, caps, [0, 1] + [2] * 6),
        # A second box behind the wall between corners 1, 2, 6 and 5.
        lambda: Body(box + [(2, 0, 0), (2, 1, 0), (2, 1, 1), (2, 0, 1)],
                     sides + [[1, 2, 9, 8], [5, 11, 10, 6], [1, 8, 11, 5], [8, 9, 10, 11], [9, 2, 6, 10]], [0] * 3 + [1] + [0] * 2 + [2] * 5,
                     [range(8), [1, 8, 9, 2, 5, 11, 10, 6]]),
    ])()
    scale, move = rng.choice([1, 0.125, 1024]), np.array([rng.choice([0, -3, 64.5]) for _ in range(3)])
    body.points = body.points * scale + move
    return body


class File:
    """What a writer of text makes of a body, and what the file holds."""

    def __init__(self, rng, body, most=99, n_labels=3, can_be_late=True):
        self.rng, self.needs = rng, []
        self.faces, points = body.cut(rng.choice([3, 4, most]) if most > 3 else 3), body.points
        if rng.random() < 0.3:  # each face has corners of its own
            points = points[[v for face, _ in self.faces for v in face]]
            count = itertools.count()
            self.faces = [([next(count) for _ in face], label) for face, label in self.faces]
        if rng.random() < 0.3:
            points = np.vstack([points, points[:1] + 0.25])
        order = rng.sample(range(len(points)), len(points)) if rng.random() < 0.3 else range(len(points))
        self.points = points[list(order)]
        place = {v: k for k, v in enumerate(order)}
        self.faces = [([place[v] for v in face], label) for face, label in self.faces]
        self.hexahedra = [[int(np.argmin(abs(self.points - body.points[v]).sum(1))) for v in h] for h in body.hexahedra]
        self.used = sorted({label for _, label in self.faces})
        self.names = rng.sample(NAMES, 3)
        self.late, self.tab = can_be_late and rng.random() < 0.3, rng.choice([" ", " ", "  ", "\t"])
        self.lines_at = [(f[0], f[1]) for f, _ in self.faces[:3]] if rng.random() < 0.3 else []
        self.with_solids = bool(self.hexahedra) and rng.random() < 0.3
        self.end = "\n"

    def n_triangles(self):
        return sum(len(face) - 2 for face, _ in self.faces)

    def bounds(self):
        used = self.points[[v for face, _ in self.faces for v in face]]
        return [used.min(0), used.max(0)]

    def maybe(self, text, share=0.4):
        return text if self.rng.random() < share else ""

    def row(self, *values):
        return self.tab.join(self.number(v) if isinstance(v, float) else str(v) for v in values) + self.maybe(" ", 0.1) + "\n"

    def number(self, x):
        return self.rng.choice([repr, "{:.17e}".format, "{:+.12f}".format])(float(x))

    def xyz(self, sep=" "):
        return [sep.join(self.number(x) for x in p) for p in self.points]

    def need(self, pattern, rows):
        if rows:
            self.needs.append(pattern)
        return rows

    def note(self, mark):
        return self.maybe(f"{mark} a remark, 1 2 3\n") + self.maybe("\n", 0.2)

    def parts(self, nodes, elements):
        return elements + nodes if self.late else nodes + elements


def stl(f, _):
    f.need_labels = {f.names[i] for i in f.used}
    case = f.rng.choice([str, str.upper])
    out, corner = "", lambda v: case("vertex ") + " ".join(f.number(x) for x in f.points[v]) + "\n"
    for i in f.used:
        rows = [case("facet normal 0 0 0\n outer loop\n") + "".join(map(corner, face)) + case("endloop\nendfacet\n") for face, n in f.faces if n == i]
        out += case("solid ") + f"{f.names[i]}\n" + "".join(rows) + case("endsolid ") + f"{f.names[i]}\n" + f.maybe("\n")
    return out


def stl_binary(f, _):
    tail = b"junk" if f.rng.random() < 0.2 else b""
    f.need(r"bytes behind", tail)
    head = f.rng.choice([b"solid x", b"COLOR=\xff\0\0\xff", b""]).ljust(80, f.rng.choice([b"\0", b" "]))
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *f.points[face].ravel(), f.rng.randrange(65536)) for face, _ in f.faces)
    return head + struct.pack("<I", len(f.faces)) + body + tail


def ply(f, kind):
    endian = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    real, extra, edges = f.rng.choice([("float", "f"), ("double", "d"), ("float64", "d")]), f.rng.random() < 0.4, f.need(THIN, f.lines_at)
    index = f.rng.choice(["vertex_indices", "vertex_index"])
    heads = [f"element vertex {len(f.points)}\n" + "".join(f"property {real[0]} {a}\n" for a in "xyz") + ("property uchar red\n" if extra else ""),
             f"element face {len(f.faces)}\n" + ("property list uchar float texcoord\n" if extra else "") + f"property list uchar int {index}\n"]
    texts = ["".join(f"{p}{' 255' if extra else ''}\n" for p in f.xyz()),
             "".join(("2 0.5 0.5 " if extra else "") + f"{len(face)} {' '.join(map(str, face))}\n" for face, _ in f.faces)]
    packed = [b"".join(struct.pack(endian + "3" + real[1], *p) + b"\xff" * extra for p in f.points),
              b"".join((struct.pack(endian + "B2f", 2, 0.5, 0.5) if extra else b"") + struct.pack(f"{endian}B{len(face)}i", len(face), *face) for face, _ in f.faces)]
    if f.late:
        heads, texts, packed = heads[::-1], texts[::-1], packed[::-1]
    if edges:
        heads.append(f"element edge {len(edges)}\nproperty int vertex1\nproperty int vertex2\n")
        texts.append("".join(f"{a} {b}\n" for a, b in edges))
        packed.append(b"".join(struct.pack(endian + "2i", *e) for e in edges))
    head = f"ply\nformat {kind} 1.0\n" + f.maybe("comment ä remark\n") + f.maybe("obj_info 3 4\n") + "".join(heads) + "end_header\n"
    return head + "".join(texts) if not endian else head.encode() + b"".join(packed)


def obj(f, _):
    word = f.rng.choice(["g", "o", "usemtl"])
    f.need_labels = {f.names[i] for i in f.used}
    slash = f.rng.choice(["", "/1", "//1", "/1/1"])
    back = not f.late and f.rng.random() < 0.3
    corner = lambda v: str(v - len(f.points) if back else v + 1) + slash
    points = "".join("v" + f.tab + p + f.maybe(" 0.5 0.5 0.5", 0.1) + "\n" + f.maybe("# remark\n", 0.1) for p in f.xyz()) + "vt 0 0\nvn 0 0 1\n"
    faces = "".join(f"{word} {f.names[i]}\n" + "".join("f" + f.tab + f.maybe("\\\n", 0.1) + " ".join(map(corner, face)) + "\n" for face, n in f.faces if n == i) for i in f.used)
    lines = "".join(f"l {a + 1} {b + 1}\n" for a, b in f.need(THIN, f.lines_at))
    return f.note("#") + "mtllib a.mtl\n" + f.parts(points, faces) + lines


def off(f, _):
    head, more = f.rng.choice([("OFF", ""), ("off", ""), ("COFF", " 255 0 0 255"), ("NOFF", " 0 0 1")])
    counts = f"{len(f.points)} {len(f.faces)}" + f.rng.choice([" 0", "", " 12"]) + "\n"
    faces = "".join(f"{len(face)}{f.tab}{' '.join(map(str, face))}{f.maybe(' 255 0 0', 0.3)}{f.maybe(' # x', 0.2)}\n" for face, _ in f.faces)
    return head + "\n" + f.note("#") + counts + f.note("#") + "".join(p + more + f.maybe(" # x", 0.1) + "\n" for p in f.xyz()) + f.maybe("\n") + faces


def grouped(f):
    return [(n, [x for x in f.faces if len(x[0]) == n]) for n in (3, 4) if any(len(x[0]) == n for x in f.faces)]


def medit(f, _):
    f.need_labels = {str(i + 1) for i in f.used}
    case, names = f.rng.choice([str, str.lower, str.upper]), {3: "Triangles", 4: "Quadrilaterals"}
    points = case("Vertices") + f"\n{len(f.points)}\n" + "".join(p + " 0\n" + f.maybe("# x\n", 0.1) for p in f.xyz())
    faces = "".join(case(names[n]) + f"\n{len(rows)}\n" + "".join(f.row(*[v + 1 for v in face], i + 1) for face, i in rows) for n, rows in grouped(f))
    edges = f.need(THIN, f.lines_at)
    more = case("Edges") + f"\n{len(edges)}\n" + "".join(f.row(a + 1, b + 1, 7) for a, b in edges) if edges else ""
    if f.with_solids:
        f.need(SOLID, f.hexahedra)
        more += case("Hexahedra") + f"\n{len(f.hexahedra)}\n" + "".join(f.row(*[v + 1 for v in h], 5) for h in f.hexahedra)
    return "MeshVersionFormatted 2\n" + f.note("#") + f.rng.choice(["Dimension 3\n", "Dimension\n3\n"]) + f.parts(points, faces + more) + f.maybe("End\n", 0.8)


def meshb(f, _):
    f.need_labels = {str(i + 1) for i in f.used}
    version, order = f.rng.choice([1, 2, 3, 4]), f.rng.choice("<>")
    integer, real, place = "q" if version == 4 else "i", "f" if version == 1 else "d", "q" if version > 2 else "i"
    out = struct.pack(order + "2i", 1, version)

    def section(number, rows):
        nonlocal out
        size = 4 + struct.calcsize("=" + place) + struct.calcsize("=" + integer) + sum(map(len, rows))
        out += struct.pack(f"{order}i{place}{integer}", number, len(out) + size, len(rows)) + b"".join(rows)

    out += struct.pack(f"{order}i{place}i", 3, len(out) + 8 + struct.calcsize("=" + place), 3)
    parts = [(4, [struct.pack(f"{order}3{real}{integer}", *p, 0) for p in f.points])]
    parts += [({3: 6, 4: 7}[n], [struct.pack(f"{order}{n + 1}{integer}", *[v + 1 for v in face], i + 1) for face, i in rows]) for n, rows in grouped(f)]
    parts += [(5, [struct.pack(f"{order}3{integer}", a + 1, b + 1, 7) for a, b in f.need(THIN, f.lines_at)])] if f.lines_at else []
    for number, rows in parts[::-1] if f.late else parts:
        section(number, rows)
    return out + struct.pack(f"{order}i{place}", 54, 0)


def msh(f, version):
    f.need_labels = {f.names[i] if version == 2 else str(i + 1) for i in f.used}
    first = f.rng.choice([1, 1, 7])
    step = f.rng.choice([1, 3])
    tag = lambda v: first + step * v
    tags = (lambda g: [2, g, g]) if version == 2 else (lambda g: [g, g])
    rows = [({3: 2, 4: 3}[len(face)], i + 1, face) for face, i in f.faces] + [(1, 9, list(e)) for e in f.need(THIN, f.lines_at)]
    if f.with_solids:
        f.need(SOLID, f.hexahedra)
        rows += [(5, 5, h) for h in f.hexahedra]
    f.rng.shuffle(rows)
    count = lambda v: [len(v)] if version == 1 else []
    elements = "".join(f.row(k + 1, kind, *tags(g), *count(v), *map(tag, v)) for k, (kind, g, v) in enumerate(rows))
    nodes = "".join(f"{tag(k)} {p}\n" for k, p in enumerate(f.xyz()))
    if version == 1:
        return f"$NOD\n{len(f.points)}\n{nodes}$ENDNOD\n$ELM\n{len(rows)}\n{elements}$ENDELM\n"
    names = "$PhysicalNames\n3\n" + "".join(f'2 {i + 1} "{n}"\n' for i, n in enumerate(f.names)) + "$EndPhysicalNames\n"
    return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + f.maybe("$Comments\n$ 1 2\n$EndComments\n") + names + f"$Nodes\n{len(f.points)}\n{nodes}$EndNodes\n$Elements\n{len(rows)}\n{elements}$EndElements\n"


def tetgen(f, kind):
    f.need_labels = {str(i + 1) for i in f.used}
    first = f.rng.choice([0, 1])
    points = f"{len(f.points)} 3 1 1\n" + "".join(f"{k + first}{f.tab}{p} 0.5 4\n" + f.maybe("# x\n", 0.1) for k, p in enumerate(f.xyz()))
    polygon = lambda face: f"{len(face)} {' '.join(str(v + first) for v in face)}"
    if kind == "smesh":
        faces = "".join(f"{polygon(face)} {i + 1}{f.maybe(' # x', 0.1)}\n" for face, i in f.faces)
    else:
        faces = "".join(f"1 0 {i + 1}\n{polygon(face)}\n" + f.maybe("# x\n", 0.1) for face, i in f.faces)
    return f.note("#") + points + f"{len(f.faces)} 1\n" + faces + "0\n" + f.maybe("0\n")


def vtk(f, _):
    rows, lines = f.faces, f.need(THIN, f.lines_at)
    out = f"# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\n" + f.maybe("FIELD FieldData 1\nTIME 1 1 double\n0.5\n") + f"POINTS {len(f.points)} double\n" + "\n".join(f.xyz()) + "\n"
    table = lambda word, cells: f"{word} {len(cells)} {sum(len(c) + 1 for c in cells)}\n" + "".join(f.row(len(c), *c) for c in cells)
    out += (table("LINES", lines) if lines else "") + table("POLYGONS", [face for face, _ in rows])
    data = f.maybe(f"CELL_DATA {len(rows) + len(lines)}\nSCALARS region int 1\nLOOKUP_TABLE default\n" + "0\n" * (len(rows) + len(lines)))
    f.need("values at cells", data)
    return out + data


def inp(f, _):
    f.need_labels = {f.names[i].replace(" ", "_") for i in f.used}
    case = f.rng.choice([str, str.upper, str.lower])
    nodes = case("*Node\n") + "".join(f"{k + 1}, {p}\n" + f.maybe("** x\n", 0.1) for k, p in enumerate(f.xyz(", ")))
    kinds, elements, count = {3: ["S3", "CPS3", "STRI3", "S3R"], 4: ["S4", "S4R", "CPS4", "M3D4"]}, "", itertools.count(1)
    for i in f.used:
        for n, rows in grouped(f):
            rows = [face for face, label in rows if label == i]
            if rows:
                elements += case("*Element, type=") + f"{f.rng.choice(kinds[n])}, {case('elset')}={f.names[i].replace(' ', '_')}\n"
                elements += "".join(f"{next(count)}, " + ", ".join(str(v + 1) for v in face) + "\n" for face in rows)
    more = "".join(f"{next(count)}, {a + 1}, {b + 1}\n" for a, b in f.need(THIN, f.lines_at))
    elements += case("*Element, type=T3D2, elset=bars\n") + more if more else ""
    if f.with_solids:
        f.need(SOLID, f.hexahedra)
        kind = f.rng.choice(["C3D8", "C3D8R", "SC8R"])
        elements += f"*ELEMENT, TYPE={kind}, ELSET=fill\n" + "".join(f"{next(count)}, " + ", ".join(str(v + 1) for v in h) + "\n" for h in f.hexahedra)
    return case("*Heading\n") + " a title\n" + f.note("**").replace("\n\n", "\n") + f.parts(nodes, elements)


def nas(f, _):
    f.need_labels = {str(i + 1) for i in f.used}
    style, count = f.rng.choice(["free", "small", "large", "tabs"]), itertools.count(1)

    def card(name, *fields):
        fields = [str(x) for x in fields]
        if style == "free":
            return ",".join([name, *fields]) + "\n" if len(fields) < 9 else ",".join([name, *fields[:8]]) + "\n," + ",".join(fields[8:]) + "\n"
        if style == "tabs":
            return "\t".join([name, *fields[:8]]) + "\n" + ("\t" + "\t".join(fields[8:]) + "\n" if len(fields) > 8 else "")
        width, per, star = (16, 4, "*") if style == "large" else (8, 8, "")
        rows = [fields[k:k + per] for k in range(0, len(fields), per)]
        return "\n".join((name + star if k == 0 else star).ljust(8) + "".join(x.ljust(width) for x in row) for k, row in enumerate(rows)) + "\n"

    # A full field before a tab is refused.
    real = lambda x: f.rng.choice([f"{x:.4f}"[:8 if f.rng.random() < 0.02 or style != "tabs" else 7], f"{x:.3f}"[:7]])
    nodes = "".join(card("GRID", k + 1, "", *map(real, p)) + f.maybe("$ x\n", 0.1) for k, p in enumerate(f.points))
    elements = "".join(card({3: "CTRIA3", 4: "CQUAD4"}[len(face)], next(count), i + 1, *[v + 1 for v in face]) for face, i in f.faces)
    elements += "".join(card(f.rng.choice(["CBAR", "CROD", "CTUBE"]), next(count), 9, a + 1, b + 1) for a, b in f.need(THIN, f.lines_at))
    if f.with_solids:
        f.need(SOLID, f.hexahedra)
        elements += "".join(card("CHEXA", next(count), 5, *[v + 1 for v in h]) for h in f.hexahedra)
    return f.rng.choice(["", "SOL 101\nCEND\n"]) + "BEGIN BULK\n" + f.note("$") + f.parts(nodes, elements) + "ENDDATA\n"


def unv(f, _):
    f.need_labels = {f.names[i] for i in f.used}
    exponent, pad = f.rng.choice(["E", "D"]), lambda *n: "".join(f"{x:10d}" for x in n) + "\n"
    data = lambda kind, text: f"    -1\n{kind:6d}\n{text}    -1\n"
    nodes = data(2411, "".join(pad(k + 1, 1, 1, 11) + "".join(f"{x:25.16E}" for x in p).replace("E", exponent) + "\n" for k, p in enumerate(f.points)))
    rows = [pad(k + 1, {3: 91, 4: 94}[len(face)], 1, 1, 7, len(face)) + pad(*[v + 1 for v in face]) for k, (face, _) in enumerate(f.faces)]
    rows += [pad(900 + k, 11, 1, 1, 7, 2) + pad(0, 1, 1) + pad(a + 1, b + 1) for k, (a, b) in enumerate(f.need(THIN, f.lines_at))]
    if f.with_solids:
        f.need(SOLID, f.hexahedra)
        rows += [pad(800 + k, 115, 1, 1, 7, 8) + pad(*[v + 1 for v in h]) for k, h in enumerate(f.hexahedra)]
    kind, groups = f.rng.choice([2467, 2477, 2435, 2452, 2430, 2432]), ""
    for i in f.used:
        ids = [k + 1 for k, (_, label) in enumerate(f.faces) if label == i]
        pairs = [x for k in ids for x in ([8, k] if kind in (2430, 2432) else [8, k, 0, 0])]
        groups += pad(i + 1, 0, 0, 0, 0, 0, 0, len(ids)) + f.names[i] + "\n" + "".join(pad(*pairs[k:k + 8]) for k in range(0, len(pairs), 8))
    units = "         1SI: Meter (newton)         2\n" + "    1.0D+0    1.0D+0    1.0D+0\n    273.15D+0\n"
    elements = data(2412, "".join(rows))
    return data(164, units) + f.parts(nodes, elements) + data(kind, groups)


# Name, ending, writer, its kind, most corners of a face, whether text may be in another encoding.
OWN = [("STL text", "stl", stl, None, 3), ("STL binary", "stl", stl_binary, None, 3), ("PLY text", "ply", ply, "ascii", 99),
       ("PLY little-endian", "ply", ply, "binary_little_endian", 99), ("PLY big-endian", "ply", ply, "binary_big_endian", 99), ("OBJ", "obj", obj, None, 99),
       ("OFF", "off", off, None, 99), ("MEDIT text", "mesh", medit, None, 4), ("MEDIT binary", "meshb", meshb, None, 4), ("MSH 1", "msh", msh, 1, 4),
       ("MSH 2.2", "msh", msh, 2, 4), ("TetGen .smesh", "smesh", tetgen, "smesh", 99), ("TetGen .poly", "poly", tetgen, "poly", 99), ("VTK text", "vtk", vtk, None, 99),
       ("Abaqus", "inp", inp, None, 4), ("Nastran", "nas", nas, None, 4), ("I-DEAS", "unv", unv, None, 4)]


def encode(rng, text):
    """Bytes of a text with some line end, encoding and mark."""
    if isinstance(text, bytes):
        return text
    text = text if rng.random() < 0.8 else text.rstrip("\n")
    text = text.replace("\n", rng.choice(["\n", "\n", "\r\n", "\r"]))
    return text.encode(rng.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1"]))


def own(entry, rng, folder, n):
    name, ending, writer, kind, most = entry
    body = bodies(rng)
    f = File(rng, body, most, can_be_late=writer not in (msh, tetgen))
    f.need_labels = None
    data = encode(rng, writer(f, kind))
    path = os.path.join(folder, f"v{n}.{ending}")
    packed = rng.choice(["", "", "", ".gz", ".zst"] if shutil.which("zstd") else ["", "", ".gz"])
    if packed == ".gz":
        path, data = path + packed, gzip.compress(data)
    with open(path, "wb") as file:
        file.write(data)
    if packed == ".zst":
        subprocess.run(["zstd", "-q", "-f", "--rm", path], check=True)
        path += packed
    want = {"triangles": f.n_triangles(), "labels": f.need_labels or {f"v{n}"}, "bounds": f.bounds()}
    return path, want, f.needs


def library(name):
    """A module, or `None` where it is not installed."""
    with contextlib.suppress(ImportError):
        return __import__(name)


def by_meshio(rng, path):
    meshio, kind = library("meshio"), os.path.splitext(path)[1]
    f = File(rng, bodies(rng), 3 if kind in (".stl", ".off") else 4)
    cells = [({3: "triangle", 4: "quad"}[n], [face for face, _ in rows]) for n, rows in grouped(f)]
    if f.lines_at and kind in (".mesh", ".msh", ".vtk", ".vtu"):
        cells.append(("line", f.need(THIN, f.lines_at)))
    if f.with_solids and kind in (".mesh", ".msh", ".vtk", ".vtu", ".inp", ".nas"):
        cells.append(("hexahedron", f.need(SOLID, f.hexahedra)))
    data = {"region": [np.arange(len(c)) for _, c in cells]} if kind in (".vtk", ".vtu") and rng.random() < 0.5 else {}
    f.need("values at cells", data)
    options = {".msh": {"file_format": "gmsh" if len(cells) == 1 else "gmsh22", "binary": rng.random() < 0.5}, ".vtk": {"binary": rng.random() < 0.5}, ".ply": {"binary": rng.random() < 0.5},
               ".vtu": {"binary": rng.random() < 0.5}, ".nas": {"point_format": "fixed-large"}}.get(kind, {})
    meshio.Mesh(f.points, cells, cell_data=data).write(path, **options)
    return {"triangles": f.n_triangles(), "bounds": f.bounds()}, f.needs


def by_trimesh(rng, path):
    trimesh, f = library("trimesh"), File(rng, bodies(rng), 3)
    mesh = trimesh.Trimesh(f.points, [face for face, _ in f.faces], process=False)
    if rng.random() < 0.5:
        mesh.visual.vertex_colors = [255, 0, 0, 255]
    mesh.export(path)
    return {"triangles": len(f.faces), "bounds": mesh.bounds}, []


def by_vtk(rng, path):
    pyvista, f = library("pyvista"), File(rng, bodies(rng))
    cells = np.concatenate([[len(face), *face] for face, _ in f.faces])
    mesh = pyvista.PolyData(f.points, faces=cells, **({"lines": np.array([[2, a, b] for a, b in f.need(THIN, f.lines_at)]).ravel()} if f.lines_at else {}))
    if path.endswith(".vtu"):
        mesh = mesh.cast_to_unstructured_grid()
    if rng.random() < 0.4:
        mesh.field_data["TIME"] = [0.5]
    if rng.random() < 0.4:
        mesh.point_data["h"] = np.arange(mesh.n_points) * 0.1
    if f.need("values at cells", rng.random() < 0.4):
        mesh.cell_data["region"] = np.arange(mesh.n_cells)
    if path.endswith((".ply", ".stl")):  # these hold faces alone
        f.needs = []
    mesh.save(path, binary=rng.random() < 0.6)
    return {"triangles": f.n_triangles(), "bounds": f.bounds()}, f.needs


def by_gmsh(rng, path):
    gmsh = library("gmsh")
    gmsh.initialize(["gmsh", "-v", "1"])
    try:
        occ, mesh, needs = gmsh.model.occ, gmsh.model.mesh, []
        boxes = [(3, occ.addBox(x, 0, 0, 1, 1, 1)) for x in range(rng.choice([1, 2]))]
        if len(boxes) > 1:
            occ.fragment(boxes[:1], boxes[1:])
        occ.synchronize()
        faces = [tag for _, tag in gmsh.model.getEntities(2)]
        with_all, kind = rng.random() < 0.4, os.path.splitext(path)[1]
        labels = None
        if not with_all:
            names = rng.sample(NAMES, 2)
            gmsh.model.addPhysicalGroup(2, faces[:3], 11, names[0])
            gmsh.model.addPhysicalGroup(2, faces[3:], 12, names[1])
            labels = set(names) if kind == ".msh" else None
        for key, value in {"Mesh.MeshSizeMin": 0.6, "Mesh.SaveAll": with_all, "Mesh.RecombineAll": rng.randrange(2),
                           "Mesh.MshFileVersion": rng.choice([1, 2.2, 4.0, 4.1]), "Mesh.BdfFieldFormat": rng.randrange(3)}.items():
            gmsh.option.setNumber(key, value)
        if gmsh.option.getNumber("Mesh.MshFileVersion") != 4.0 or kind != ".msh":
            gmsh.option.setNumber("Mesh.Binary", rng.randrange(2))
        has_solids = with_all and rng.random() < 0.5 and gmsh.option.getNumber("Mesh.RecombineAll") == 0
        mesh.generate(3 if has_solids else 2)
        count = lambda kind: len(mesh.getElementsByType(kind)[0])
        if with_all and kind in (".msh", ".mesh", ".vtk"):
            needs += [THIN] + [SOLID] * bool(has_solids)
        curved = kind in (".msh", ".vtk", ".inp", ".unv") and rng.random() < 0.3
        if curved:
            mesh.setOrder(2)
            needs.append(CURVED)
        triangles = count(9) + 2 * count(10) + 2 * count(16) if curved else count(2) + 2 * count(3)
        gmsh.write(path)
        if labels and open(path, "rb").read(4) == b"$NOD":  # version 1 has no names
            labels = {"11", "12"}
        return {"triangles": triangles, "labels": labels, "bounds": [[0, 0, 0], [len(boxes), 1, 1]]}, needs
    finally:
        gmsh.finalize()


# Module, writer, endings.
OTHERS = [("meshio", by_meshio, "stl ply obj off mesh msh vtk vtu inp nas"), ("trimesh", by_trimesh, "stl ply obj off"),
          ("pyvista", by_vtk, "vtk vtp vtu ply stl"), ("gmsh", by_gmsh, "msh mesh inp bdf unv vtk stl off")]


def other_counts(path):
    """Triangles by meshio or trimesh, or `None`."""
    with contextlib.suppress(BaseException), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        cells = library("meshio").read(path).cells
        return sum(len(c.data) * (c.data.shape[1] - 2 if c.type == "polygon" else {"triangle": 1, "quad": 2}.get(c.type, 0)) for c in cells)
    with contextlib.suppress(BaseException):
        return len(library("trimesh").load(path, process=False, force="mesh").faces)


def check(tetdb, path):
    """What the program finds, or `None`, and all it says."""
    run = subprocess.run([tetdb, "check", path, "--json"], capture_output=True)
    said = (run.stderr + run.stdout).decode(errors="replace")
    try:
        return json.loads(run.stdout), said, run.returncode
    except ValueError:
        return None, said, run.returncode


def differences(found, want, needs, said):
    wrong = [f"nothing says /{pattern}/" for pattern in needs if not re.search(pattern, said)]
    if found["triangles"] != want["triangles"]:
        wrong.append(f"{found['triangles']} triangles instead of {want['triangles']}")
    if want.get("labels") is not None and set(found["labels"]) != set(want["labels"]):
        wrong.append(f"labels {sorted(found['labels'])} instead of {sorted(want['labels'])}")
    if want.get("bounds") is not None and not np.allclose(found["bounds"], want["bounds"], rtol=1e-5, atol=1e-4):
        wrong.append(f"bounds {found['bounds']} instead of {np.array(want['bounds']).tolist()}")
    return wrong


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("tetdb")
    words.add_argument("n", nargs="?", type=int, default=20)
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--keep")
    words.add_argument("--collection")
    options = words.parse_args()
    table, shown = {}, collections.Counter()

    def compare(name, path, want, needs):
        row = table.setdefault(name, collections.Counter())
        found, said, code = check(options.tetdb, path)
        if found is None:
            result = "refused" if code == 3 and "panicked" not in said else "SILENT"
            wrong = [said.strip()[:300]]
        else:
            wrong = differences(found, want, needs, said)
            if name == "collection" and "belong to another group" in said:  # which others count twice
                needs, wrong = [said], []
            result = "SILENT" if wrong else "noted" if needs else "equal"
        row["variants"] += 1
        row[result] += 1
        key = (name, result, re.sub(r"\d+", "N", wrong[0])[:60] if wrong else "")
        shown[key] += 1
        if wrong and shown[key] == 1:
            print(f"{result}: {name}, {os.path.basename(path)}: {'; '.join(wrong)}")
            if options.keep:
                os.makedirs(options.keep, exist_ok=True)
                shutil.copy(path, options.keep)

    with tempfile.TemporaryDirectory() as folder:
        for entry in OWN:
            for n in range(options.n):
                rng = random.Random(f"{options.seed} {entry[0]} {n}")
                compare(entry[0], *own(entry, rng, folder, n))
        for module, writer, endings in OTHERS:
            for ending in endings.split() if library(module) else []:
                for n in range(options.n):
                    rng, path = random.Random(f"{options.seed} {module} {ending} {n}"), os.path.join(folder, f"v{n}.{ending}")
                    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                        want, needs = writer(rng, path)
                    compare(f".{ending} of {module}", path, want, needs)
            if not library(module):
                print(f"skipped: {module} is not installed")
    for path in sorted(glob.glob(os.path.join(options.collection, "**", "*.*"), recursive=True)) if options.collection else []:
        count = other_counts(path)
        if count:
            compare("collection", path, {"triangles": count}, [])
    columns = ["variants", "equal", "noted", "refused", "SILENT"]
    print(f"{'format':24}" + "".join(f"{c:>10}" for c in columns))
    for name, row in table.items():
        print(f"{name:24}" + "".join(f"{row[c]:10}" for c in columns))
    sys.exit(1 if any(row["SILENT"] for row in table.values()) else 0)


main()
