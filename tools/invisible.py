#!/usr/bin/env python3
"""Can one see in a finished mesh where it was cut?

    python3 tools/invisible.py parts.vtu whole.vtu [--size H]

`parts.vtu` is the export of a mesh in two sub-domains, `whole.vtu` that of the same surface and options in one. The cut is fitted by a
plane; in `whole.vtu` the same plane is a fake one, which tells what chance and the surface do. Sizes must be uniform away from the
surface (such as a box): they are taken as H, or as the median edge length.

Printed, for the true and the fake plane, over tetrahedra farther than 2 H from the surface:
- Kolmogorov distances of quality and of edge length between tetrahedra nearer than 1 H to the plane (and 3.5 to 6.5 H, where the
  refined zone ended) and those farther than 8 H;
- densities of vertices in slices of 0.25 H out to 8 H: coefficient of variation, and what chance alone would make of it;
- the area under the curve of a classifier that tries to tell near tetrahedra from far ones by their shape, size, valences and
  directions, trained on one half of the plane and tested on the other; 0.5 is guessing.
Needs numpy, scipy, pyvista and scikit-learn.
"""
import argparse

import numpy as np
import pyvista
from scipy.spatial import cKDTree
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score

FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def read(path):
    grid = pyvista.read(path)
    tets = grid.cells.reshape(-1, 5)[:, 1:].astype(np.int64)
    return np.asarray(grid.points, float), tets, np.asarray(grid.cell_data["subdomain"])


def pair_faces(tets):
    """Tetrahedra on both sides of each inner face, the face's vertices, and the faces with one side."""
    n = len(tets)
    faces = np.sort(tets[:, FACES].reshape(-1, 3), axis=1)
    order = np.lexsort(faces.T[::-1])
    ordered = faces[order]
    same = (ordered[1:] == ordered[:-1]).all(1)
    first = np.flatnonzero(same)
    alone = np.ones(len(faces), bool)
    alone[order[first]] = alone[order[first + 1]] = False
    return order[first] // 4, order[first + 1] // 4, ordered[first], faces[alone], n


def features(points, tets, normal, size):
    p = points[tets]
    edges = p[:, EDGES[:, 1]] - p[:, EDGES[:, 0]]
    length = np.linalg.norm(edges, axis=2)
    volume = np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6
    areas = [np.linalg.norm(np.cross(p[:, f[1]] - p[:, f[0]], p[:, f[2]] - p[:, f[0]]), axis=1) / 2 for f in FACES]
    quality = np.sqrt(6) / 12 * length.max(1) / (3 * volume / np.sum(areas, axis=0))
    valence = np.bincount(np.unique(np.sort(tets[:, EDGES].reshape(-1, 2), axis=1), axis=0).ravel(), minlength=len(points))
    slope = np.sort(np.abs(edges @ normal) / length, axis=1)
    columns = [quality, np.sort(length, axis=1) / size, volume / size**3, np.sort(valence[tets], axis=1), slope]
    return quality, length / size, np.column_stack([c if c.ndim == 2 else c[:, None] for c in columns])


def kolmogorov(a, b):
    at = np.sort(np.concatenate([a, b]))
    return np.abs(np.searchsorted(np.sort(a), at, "right") / len(a) - np.searchsorted(np.sort(b), at, "right") / len(b)).max()


def judge(name, points, tets, normal, offset, size, surface_distance):
    middle = points[tets].mean(1)
    s = (middle @ normal - offset) / size
    inner = surface_distance(middle) > 2 * size
    quality, length, columns = features(points, tets, normal, size)
    far = inner & (np.abs(s) > 8)
    near = {"< 1 h": inner & (np.abs(s) < 1), "3.5-6.5 h": inner & (np.abs(s) > 3.5) & (np.abs(s) < 6.5)}
    across = np.linalg.svd(normal[None])[2][1]
    half = middle @ across > np.median(middle @ across)
    rng = np.random.default_rng(1)
    for kind, chosen in near.items():
        auc = []
        for side in (half, ~half):
            train = np.concatenate([rng.permutation(np.flatnonzero(c & side))[:40000] for c in (chosen, far)])
            test = np.concatenate([rng.permutation(np.flatnonzero(c & ~side))[:40000] for c in (chosen, far)])
            model = HistGradientBoostingClassifier(max_iter=120, random_state=1).fit(columns[train], chosen[train])
            auc.append(roc_auc_score(chosen[test], model.predict_proba(columns[test])[:, 1]))
        print(f"{name:6} {kind:10} {chosen.sum():8} tets: KS quality {kolmogorov(quality[chosen], quality[far]):.4f}, KS edge length "
              f"{kolmogorov(length[chosen].ravel(), length[far].ravel()):.4f}, AUC {np.mean(auc):.3f}")
    inside = surface_distance(points) > 2 * size
    d = (points[inside] @ normal - offset) / size
    counts = np.histogram(d, np.arange(-8, 8.01, 0.25))[0]
    print(f"{name:6} density in 64 slices: cv {counts.std() / counts.mean():.4f}, chance {1 / np.sqrt(counts.mean()):.4f}, "
          f"extremes {counts.min() / counts.mean() - 1:+.3f} {counts.max() / counts.mean() - 1:+.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts")
    parser.add_argument("whole")
    parser.add_argument("--size", type=float)
    args = parser.parse_args()
    points, tets, part = read(args.parts)
    a, b, faces, hull, _ = pair_faces(tets)
    cut = part[a] != part[b]
    at = points[np.unique(faces[cut])]
    center = at.mean(0)
    normal = np.linalg.svd(at - center, full_matrices=False)[2][2]
    edge = points[faces[:, 0]] - points[faces[:, 1]]
    size = args.size or float(np.median(np.linalg.norm(edge, axis=1)))
    offset = float(center @ normal)
    q = points[faces[cut]]
    print(f"{cut.sum()} interface faces, plane {normal.round(4)} at {offset:.4f}, h {size:.5f}, spread "
          f"{np.std((at - center) @ normal) / size:.2f} h, area {np.linalg.norm(np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), axis=1).sum() / 2 / size**2:.0f} h2")
    for name, path in (("cut", None), ("fake", args.whole)):
        if path:
            points, tets, _ = read(path)
            hull = pair_faces(tets)[3]
        tree = cKDTree(points[hull].mean(1))
        judge(name, points, tets, normal, offset, size, lambda p, tree=tree: tree.query(p, workers=2)[0])


if __name__ == "__main__":
    main()
