#!/usr/bin/env python3
"""Bodies united, cut and intersected at random, as programs for printing make them: full of slivers where surfaces almost agree.

    pip install manifold3d numpy
    python3 tools/booleans.py FOLDER FROM TO     # one body for each seed: N.off in doubles, N.stl in floats, in turns

Of boxes, spheres, cylinders, cones, rings, star-shaped prisms (twisted, too) and tetrahedra, turned or not, on coarse, fine or no grid. Rounded to floats, or
where faces lie on each other but for rounding, some of them cross themselves: these are to be refused.
"""
import sys

import manifold3d
import numpy as np

TRIANGLES_MAX = 6000


def primitive(r):
    kind, s, n = r.integers(6), r.uniform(0.2, 1.2, 3), int(r.integers(8, 40))
    solid, section = manifold3d.Manifold, manifold3d.CrossSection
    if kind == 0:
        body = solid.cube(s.tolist(), True)
    elif kind == 1:
        body = solid.sphere(float(s[0]), n)
    elif kind == 2:
        body = solid.cylinder(float(2 * s[0]), float(s[1]), float(s[1] * r.choice([1, 0.5, 0.01])), n, True)
    elif kind == 3:
        body = section.circle(float(0.3 * s[0]), n).translate((float(s[1] + 0.5), 0.0)).revolve(n)
    elif kind == 4:
        angle = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
        radius = np.where(np.arange(2 * n) % 2, s[0], 0.8 * s[0])
        star = section([np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1).tolist()])
        body = star.extrude(float(s[1]), 0, float(r.choice([0, 30, 90])))
    else:
        body = solid.tetrahedron().scale(s.tolist())
    if r.random() < 0.4:
        body = body.rotate(r.uniform(0, 360, 3).tolist())
    grid, at = r.choice([0, 0.25, 0.01]), r.uniform(-0.8, 0.8, 3)
    return body.translate((np.round(at / grid) * grid if grid else at).tolist())


def body_of(seed):
    r = np.random.default_rng(seed)
    body = primitive(r)
    for _ in range(int(r.integers(2, 14))):
        what, other = r.integers(3), primitive(r)
        new = body - other if what == 1 else body ^ other if what == 2 and r.random() < 0.3 else body + other
        if new.num_tri():
            body = new
    return body


def main():
    folder, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    for seed in range(first, last):
        body = body_of(seed)
        if not 0 < body.num_tri() <= TRIANGLES_MAX:
            continue
        mesh = body.to_mesh64() if seed % 2 else body.to_mesh()
        points, triangles = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)
        if seed % 2:
            with open(f"{folder}/{seed}.off", "w") as out:
                print(f"OFF\n{len(points)} {len(triangles)} 0", file=out)
                out.writelines("%r %r %r\n" % tuple(p) for p in points.tolist())
                out.writelines("3 %d %d %d\n" % tuple(t) for t in triangles.tolist())
        else:
            records = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
            records["corners"] = points[triangles]
            with open(f"{folder}/{seed}.stl", "wb") as out:
                out.write(b" " * 80 + np.uint32(len(triangles)).tobytes() + records.tobytes())


if __name__ == "__main__":
    main()
