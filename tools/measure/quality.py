"""Measures of tetrahedra, shared by the scripts beside it: quality, angles, locally Delaunay faces, the least quality a triangle forces.

q = (sqrt(6)/12) * longest edge / inradius: 1 for the regular tetrahedron, larger is worse, infinite where the volume is not positive.
*Excess* is q over the least q that any tetrahedron on the same input triangle can have. The search for that least q is independent of
tetdb's own. Two triangles that meet at a sharp edge force more than each alone does; the search leaves that out.
*Forced* tetrahedra have four vertices on the surface, or a triangle of the surface on which no tetrahedron can have q < 2.
"""
import numpy as np

ALPHA = 6**0.5 / 12
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
BLOCK = 1 << 19
# The search for the best apex starts here, in longest edges: along the longest edge, away from it, up.
START, HALF = np.array([0.5, 0.2, 0.6]), 1.0
GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 3)] * 3), -1).reshape(-1, 3)


def quality(p):
    """q of tetrahedra (n, 4, 3), and the largest cosine between two outward face normals' opposites (of the smallest dihedral angle)."""
    normals = np.stack([np.cross(p[:, f[1]] - p[:, f[0]], p[:, f[2]] - p[:, f[0]]) for f in FACES], 1)
    areas = np.linalg.norm(normals, axis=2)
    six = -np.einsum("ij,ij->i", p[:, 0] - p[:, 1], normals[:, 0])
    longest = np.sqrt(np.max([((p[:, i] - p[:, j])**2).sum(1) for i, j in EDGES], axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        q = np.where(six > 0, ALPHA * longest * areas.sum(1) / six, np.inf)
        normals /= areas[:, :, None]
    cosine = np.max([-np.einsum("ij,ij->i", normals[:, i], normals[:, j]) for i, j in EDGES], axis=0)
    return q, cosine


def qualities(points, tets):
    """q of each tetrahedron, and the least dihedral angle of all in degrees; by blocks."""
    q, cosine = np.empty(len(tets)), -1.0
    for s in range(0, len(tets), BLOCK):
        q[s:s + BLOCK], cosines = quality(points[tets[s:s + BLOCK]])
        cosine = max(cosine, float(np.nanmax(cosines)))
    return q, float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def oriented(points, tets):
    """The same tetrahedra, with positive volumes if the file had them negative."""
    a, b, c, d = (points[tets[:1000, k]] for k in range(4))
    mean = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)).mean()
    return tets[:, [0, 2, 1, 3]] if mean < 0 else tets


def keys(faces):
    """A 64-bit mix of each row of three vertices, whatever their order."""
    faces = np.sort(faces, axis=1).astype(np.uint64)
    mixed = np.zeros(len(faces), np.uint64)
    for k in range(3):
        mixed = (mixed ^ faces[:, k]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def inner_radius(corners):
    """Radius of the inscribed circle of triangles (n, 3, 3) over their longest edge."""
    a, b, c = (corners[:, k] for k in range(3))
    lengths = np.stack([np.linalg.norm(x - y, axis=1) for x, y in ((a, b), (b, c), (c, a))])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / lengths.sum(0) / lengths.max(0)


def pair_faces(tets):
    """Faces as `tetrahedron + n * face`: those of the hull, and both sides of each inner face."""
    key = np.concatenate([keys(tets[:, FACES[k]]) for k in range(4)])
    order = np.argsort(key, kind="stable")
    key = key[order]
    equal = key[1:] == key[:-1]
    alone = np.ones(len(key), bool)
    alone[1:] &= ~equal
    alone[:-1] &= ~equal
    return order[alone], order[:-1][equal], order[1:][equal]


def delaunay_share(points, tets, first, second):
    """Share of inner faces, in percent, beyond which no vertex is inside the sphere by more than rounding."""
    n, count = len(tets), 0
    for s in range(0, len(first), BLOCK):
        f, g = first[s:s + BLOCK], second[s:s + BLOCK]
        apex = points[tets[g % n, g // n]]
        x = points[tets[f % n]] - apex[:, None]
        squares = (x**2).sum(2)
        # Each term is a square times the volume of the other three as seen from the apex; positive: the apex is inside.
        det = sum(squares[:, i] * np.einsum("ij,ij->i", x[:, o[0]], np.cross(x[:, o[1]], x[:, o[2]])) for i, o in enumerate(FACES))
        count += int((det <= 1e-13 * squares.max(1)**2.5).sum())
    return 100 * count / max(1, len(first))


def measure(points, tets, n_surface):
    """Measures of a mesh whose boundary faces are the triangles of its surface."""
    tets, n = oriented(points, tets), len(tets)
    hull, first, second = pair_faces(tets)
    hull_faces = tets[(hull % n)[:, None], FACES[hull // n]]
    on_surface = np.zeros(len(points), bool)
    on_surface[hull_faces.ravel()] = True
    forced = on_surface[tets].all(1)
    forced[(hull % n)[~(ALPHA < 2 * inner_radius(points[hull_faces]))]] = True
    q, dihedral = qualities(points, tets)
    free = q[~forced]
    return {"tets": n, "vertices": int(len(np.unique(tets))), "negative": int(np.isinf(q).sum()), "hull_faces": len(hull),
            "surface_triangles": n_surface, "q12": 100 * float((q < 2).mean()), "worst": float(q.max()),
            "forced": 100 * float(forced.mean()), "q12_unforced": 100 * float((free < 2).mean()) if len(free) else 100.0,
            "worst_unforced": float(free.max()) if len(free) else 0.0, "dihedral": dihedral,
            "delaunay": delaunay_share(points, tets, first, second)}


def quality_above(base, apex):
    """q with apexes (n, k, 3) over triangles (n, 3, 2) of longest edge 1: the inradius is three volumes over the sum of the areas."""
    longest, areas = np.ones(apex.shape[:2]), 0.0
    for k in range(3):
        a, b = base[:, None, k], base[:, None, (k + 1) % 3]
        edge, to = b - a, apex[..., :2] - a
        longest = np.maximum(longest, (to**2).sum(-1) + apex[..., 2]**2)
        away = edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0]
        areas = areas + np.sqrt(away**2 + (edge**2).sum(-1) * apex[..., 2]**2)
    double = np.abs(base[:, 1, 0] * base[:, 2, 1])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        q = ALPHA * np.sqrt(longest) * (areas + double) / (double * apex[..., 2])
    return np.where(np.isfinite(q), q, np.inf)


def face_least(corners):
    """The least q of tetrahedra on triangles (n, 3, 3): a grid of apexes, moved to its best and made finer again and again."""
    least = np.empty(len(corners))
    for s in range(0, len(corners), 4096):
        p = corners[s:s + 4096]
        lengths = np.stack([np.linalg.norm(p[:, (k + 1) % 3] - p[:, k], axis=1) for k in range(3)], 1)
        turn = lengths.argmax(1)
        a, b, c = (p[np.arange(len(p)), (turn + k) % 3] for k in range(3))
        longest = lengths.max(1, keepdims=True)
        u, v = (b - a) / longest, (c - a) / longest
        x = np.einsum("ij,ij->i", u, v)
        y = np.linalg.norm(np.cross(u, v), axis=1)
        corners_2d = np.zeros((len(p), 3, 2))
        corners_2d[:, 1, 0], corners_2d[:, 2, 0], corners_2d[:, 2, 1] = 1, x, y
        at, half, best = np.repeat(START[None], len(p), 0), np.full(len(p), HALF), np.full(len(p), np.inf)
        rows = np.arange(len(p))
        for _ in range(56):
            apex = at[:, None] + half[:, None, None] * GRID
            apex[..., 2] = np.abs(apex[..., 2])
            q = quality_above(corners_2d, apex)
            k = q.argmin(1)
            better = q[rows, k] < best
            at[better], best[better] = apex[rows, k][better], q[rows, k][better]
            half *= np.where(better, 0.9, 0.65)
        least[s:s + 4096] = best
    return least



def place_numbers(surface_points, points):
    """One number for each position, for vertices of the surface and of the mesh, whatever their order."""
    _, number = np.unique(np.concatenate([surface_points, points]) + 0.0, axis=0, return_inverse=True)
    number = number.reshape(-1)
    return number[:len(surface_points)], number[len(surface_points):]


def measure_elements(points, tets, surface_points, triangles):
    """Worst elements of a mesh against the bounds of its input triangles, and whether it has every input triangle and no other on its hull."""
    tets = oriented(points, tets)
    given, own = place_numbers(surface_points, points)
    wanted = np.unique(keys(given[triangles]))
    key = np.stack([keys(own[tets[:, f]]) for f in FACES], 1)
    on_surface = np.isin(key, wanted)
    complete = len(np.unique(key[on_surface])) == len(wanted) and len(pair_faces(tets)[0]) <= len(wanted)
    q, dihedral = qualities(points, tets)
    floor = np.zeros(on_surface.shape)
    for i, f in enumerate(FACES):
        with np.errstate(divide="ignore"):
            floor[:, i] = np.where(on_surface[:, i], ALPHA / inner_radius(points[tets[:, f]]), 0)
    # The least q of a face is between its floor and 1.42 times that: the search is for faces where the difference matters.
    bound = np.maximum(floor.max(1), 1.0)
    t, i = np.nonzero(on_surface & ((q[:, None] < 1.42 * floor) | (q[:, None] > 2)) & np.isfinite(floor) & (1.42 * floor >= bound[:, None]))
    least = face_least(points[tets[t[:, None], FACES[i]]]) if len(t) else np.empty(0)
    np.maximum.at(bound, t, least)
    excess = np.where(np.isfinite(bound), q / bound, 1.0)
    return {"n": len(tets), "good": 100 * float((q < 2).mean()), "poor": int((q >= 10).sum()), "worst": float(q.max()), "excess": float(excess.max()),
            "over": 100 * float((excess > 2).mean()), "dihedral": dihedral, "complete": complete, "below": int((excess < 0.999).sum())}


def measure_embedded(points, tets, where, triangles, edges, marks):
    """What a mesh keeps of its input triangles, edges and points; the quality of tetrahedra with a vertex that is not of the input."""
    tets = oriented(points, tets)
    # Vertices that no tetrahedron has are none.
    used, corners = np.unique(tets, return_inverse=True)
    points, tets = points[used], corners.reshape(-1, 4)
    given, own = place_numbers(where, points)
    key = np.unique(np.concatenate([keys(own[tets[:, f]]) for f in FACES]))
    pairs = np.unique(np.sort(own[tets[:, EDGES].reshape(-1, 2)], axis=1), axis=0)
    size = max(given.max(), own.max()) + 1
    lines = np.sort(given[edges].reshape(-1, 2), axis=1)
    kept = [int(np.isin(keys(given[triangles]), key).sum()), int(np.isin(lines @ [size, 1], pairs @ [size, 1]).sum()),
            int(np.isin(given[marks], own).sum())]
    q, _ = qualities(points, tets)
    free = q[~np.isin(own, given)[tets].all(1)]
    counts = [f"{k} of {len(of)}" if len(of) else "-" for k, of in zip(kept, (triangles, edges, marks))]
    return {"tets": len(tets), "negative": int(np.isinf(q).sum()), "kept": counts,
            "below 2": 100 * float((free < 2).mean()) if len(free) else 100.0, "worst": float(free.max()) if len(free) else 0.0, "all": float(q.max())}
