#!/usr/bin/env python3
"""Do the tetrahedra near an interface between two sub-domains differ from the others?

  invisible.py --sample box,h=0.0155 --sample box,h=0.017 [--tetdb PROGRAM] [--graded]
  invisible.py --pair parts.vtu whole.vtu

Each cut is a pair of exports: a mesh in two sub-domains, and a mesh of the same surface in one. --sample generates both; it may name a surface
file. In the mesh of one sub-domain the other's interface is a fake cut, which shows what chance and the surface do. The wanted length is the
median edge of the whole mesh, or with --graded the mean edge around some hundred vertices.

Printed for true and fake cuts, all cuts together, away from the surface (farther than 2 h) and near it:
- Kolmogorov distances of quality, of edge length over h and of its mean in each tetrahedron, between tetrahedra nearer than 1 h to the
  interface (or at 3.5 to 6.5 h, where the refined zone ended) and those farther than 8 h;
- the area under the curve of a classifier that tells near from far tetrahedra by shape, size, valences and directions; it is trained on all
  cuts but one and tested on that one (with one cut, on halves of the plane). 0.5 is guessing;
- densities of vertices in slices of 0.25 h out to 8 h from the plane: coefficient of variation, and that of chance alone;
- mean and 95th percentile of edge lengths within 4 h of the interface, over those of the mesh in one sub-domain.
Needs numpy, scipy, pyvista and scikit-learn. Small meshes have nothing farther than 8 h: use h <= 0.03 on the box.
"""
import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
import pyvista
from scipy.spatial import cKDTree
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score

from quality import EDGES, FACES, qualities


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


def unique_edges(tets):
    return np.unique(np.sort(tets[:, EDGES].reshape(-1, 2), axis=1), axis=0)


class Sizes:
    """Wanted lengths at any points: one for all, or the mean of the edges around."""

    def __init__(self, points, tets, graded):
        edges = unique_edges(tets)
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        self.median = float(np.median(length))
        self.tree = None
        if graded:
            n = np.bincount(edges.ravel(), minlength=len(points))
            sums = np.bincount(edges[:, 0], length, len(points)) + np.bincount(edges[:, 1], length, len(points))
            mean = sums / np.maximum(n, 1)
            # Some hundred neighbors average out the noise of single edges; the effect of a zone of a few lengths stays in part.
            self.tree = cKDTree(points)
            self.values = np.concatenate([mean[self.tree.query(some, 200, workers=2)[1]].mean(1)
                                          for some in np.array_split(points, 1 + len(points) // 100000)])

    def at(self, places):
        if self.tree is None:
            return np.full(len(places), self.median)
        return self.values[self.tree.query(places, workers=2)[1]]


def features(points, tets, normal, size):
    p = points[tets]
    edges = p[:, EDGES[:, 1]] - p[:, EDGES[:, 0]]
    length = np.linalg.norm(edges, axis=2)
    volume = np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6
    quality, _ = qualities(points, tets)
    valence = np.bincount(unique_edges(tets).ravel(), minlength=len(points))
    length = length / size[:, None]
    slope = np.sort(np.abs(edges @ normal) / (length * size[:, None]), axis=1)
    columns = [quality, np.sort(length, axis=1), volume / size**3, np.sort(valence[tets], axis=1), slope]
    return quality, length, np.column_stack([c if c.ndim == 2 else c[:, None] for c in columns])


def kolmogorov(a, b):
    at = np.sort(np.concatenate([a, b]))
    return np.abs(np.searchsorted(np.sort(a), at, "right") / len(a) - np.searchsorted(np.sort(b), at, "right") / len(b)).max()


SAMPLES = 30000
NEAR = {"< 1 h": (0, 1), "3.5-6.5 h": (3.5, 6.5)}


class Cut:
    """Features of all tetrahedra of one mesh, and where they are relative to an interface (true or fake)."""

    def __init__(self, mesh, interface, normal, offset, sizes):
        points, tets = mesh[:2]
        walls = points[pair_faces(tets)[3]]
        hull = cKDTree(walls.mean(1))
        middle = points[tets].mean(1)
        size = sizes.at(middle)
        plane = np.abs(middle @ normal - offset) / size
        # Only what is near the plane needs its distance to the interface itself.
        self.distance = plane.copy()
        band = plane < 9
        self.distance[band] = interface.query(middle[band], workers=2)[0] / size[band]
        away, wall = hull.query(middle, workers=2)
        self.inner = away > 2 * size
        # Walls that face the cut are not met by it: near the surface only those it crosses are compared.
        facing = np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
        facing = np.abs(facing @ normal) > 0.5 * np.linalg.norm(facing, axis=1)
        self.distance[~self.inner & facing[wall]] = np.nan
        self.quality, self.length, self.columns = features(points, tets, normal, size)
        across = np.linalg.svd(normal[None])[2][1]
        self.half = middle @ across > np.median(middle @ across)
        size = sizes.at(points)
        away = hull.query(points, workers=2)[0] > 2 * size
        d = (points[away] @ normal - offset) / size[away]
        self.slices = np.histogram(d, np.arange(-8, 8.01, 0.25))[0]

    def near(self, kind, inner):
        low, high = NEAR[kind]
        return (self.inner == inner) & (self.distance >= low) & (self.distance < high)

    def far(self, inner):
        return (self.inner == inner) & (self.distance > 8)


def some(rng, chosen):
    return rng.permutation(np.flatnonzero(chosen))[:SAMPLES]


def auc(cuts, kind, inner):
    """Mean over the cuts of the area under the curve, each tested with a classifier trained on the others."""
    rng = np.random.default_rng(1)
    if len(cuts) > 1:
        folds = [([(c, True) for j, c in enumerate(cuts) if j != i], [(cuts[i], True)]) for i in range(len(cuts))]
    else:
        folds = [([(cuts[0], side)], [(cuts[0], ~side)]) for side in (cuts[0].half, ~cuts[0].half)]
    areas = []
    for train, test in folds:
        sets = []
        for part in (train, test):
            picks = [(c, some(rng, c.near(kind, inner) & where), some(rng, c.far(inner) & where)) for c, where in part]
            # As many of each kind from each cut: else a cut could be known by its size.
            picks = [(c, n[: min(len(n), len(f))], f[: min(len(n), len(f))]) for c, n, f in picks]
            sets.append((np.concatenate([c.columns[i] for c, n, f in picks for i in (n, f)]),
                         np.concatenate([np.repeat([1, 0], [len(n), len(f)]) for _, n, f in picks])))
        model = HistGradientBoostingClassifier(max_iter=120, random_state=1).fit(*sets[0])
        areas.append(roc_auc_score(sets[1][1], model.predict_proba(sets[1][0])[:, 1]))
    return float(np.mean(areas))


def report(name, cuts):
    for inner in (True, False):
        place = "away from the surface" if inner else "near the surface"
        for kind in NEAR:
            near = [c.near(kind, inner) for c in cuts]
            far = [c.far(inner) for c in cuts]
            both = [np.concatenate([v(c)[m].ravel() for c, m in zip(cuts, masks)]) for v in
                    (lambda c: c.quality, lambda c: c.length, lambda c: c.length.mean(1)) for masks in (near, far)]
            print(f"{name:10} {place:21} {kind:10} {sum(m.sum() for m in near):8} tets: KS quality {kolmogorov(*both[:2]):.4f}, "
                  f"KS edge length {kolmogorov(*both[2:4]):.4f}, KS mean edge {kolmogorov(*both[4:]):.4f} "
                  f"({both[4].mean() / both[5].mean() - 1:+.2%}), AUC {auc(cuts, kind, inner):.3f}", flush=True)
    # Slices of cuts with other sizes are compared as shares of their own mean.
    shares = np.mean([c.slices / c.slices.mean() for c in cuts], axis=0)
    chance = np.sqrt(np.sum([1 / c.slices.mean() for c in cuts])) / len(cuts)
    print(f"{name:10} density in 64 slices: cv {shares.std():.4f}, chance {chance:.4f}, extremes {shares.min() - 1:+.3f} {shares.max() - 1:+.3f}", flush=True)


def exports(surface, tetdb, folder):
    """Exports of the surface in two sub-domains and in one."""
    paths = []
    surface = surface if pathlib.Path(surface).exists() else f"sample:{surface}"
    for n in (2, 1):
        store, out = folder / "cut.tetdb", folder / f"{n}.vtu"
        for command in (["mesh", surface, "-o", store, "--subdomains", n, "--no-verify", "--force", "-q"],
                        ["export", store, out, "-q"]):
            subprocess.run([tetdb, *map(str, command)], check=True, stdout=subprocess.DEVNULL)
        paths.append(out)
    return paths


def compare(name, parts, whole, graded):
    """The true cut and the fake one of a pair of exports."""
    points, tets, part = read(parts)
    a, b, faces, _, _ = pair_faces(tets)
    cut = part[a] != part[b]
    at = points[np.unique(faces[cut])]
    center = at.mean(0)
    normal = np.linalg.svd(at - center, full_matrices=False)[2][2]
    one = read(whole)[:2]
    sizes = Sizes(*one, graded)
    offset = float(center @ normal)
    interface = cKDTree(np.concatenate([at, points[faces[cut]].mean(1)]))
    size = sizes.at(at)
    print(f"{name}: {cut.sum()} interface faces, plane {normal.round(4)} at {offset:.4f}, h {size.min():.5f} to {size.max():.5f}, "
          f"spread {np.std((at - center) @ normal / size):.2f} h", flush=True)
    cuts = [Cut(mesh, interface, normal, offset, sizes) for mesh in ((points, tets), one)]
    for inner in (True, False):
        lengths = [c.length[(c.inner == inner) & (c.distance < 4)].ravel() for c in cuts]
        mean, high = ([f(l) for l in lengths] for f in (np.mean, lambda l: np.quantile(l, 0.95)))
        print(f"  {'away from' if inner else 'near'} the surface, within 4 h: edge length over that of one piece: mean {mean[0] / mean[1]:.4f}, 95th percentile {high[0] / high[1]:.4f}")
    return cuts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pair", nargs=2, action="append", default=[], metavar=("PARTS", "WHOLE"))
    parser.add_argument("--sample", action="append", default=[], help="a sample's name, or a surface file")
    parser.add_argument("--graded", action="store_true")
    parser.add_argument("--tetdb", default="tetdb")
    args = parser.parse_args()
    if not args.pair and not args.sample:
        parser.error("give --sample or --pair")
    pairs = [compare(pair[0], *pair, args.graded) for pair in args.pair]
    for sample in args.sample:
        with tempfile.TemporaryDirectory() as folder:
            pairs.append(compare(sample, *exports(sample, args.tetdb, pathlib.Path(folder)), args.graded))
    cut, fake = zip(*pairs)
    report("cuts", cut)
    report("fakes", fake)


if __name__ == "__main__":
    main()
