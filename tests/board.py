#!/usr/bin/env python3
"""A printed board as three surfaces to mesh: a thin box, layers of copper tracks in it as sheets, vias as edges, pads as points.

  board.py FOLDER [CELLS] [LAYERS] [SEED]

Writes FOLDER/board.obj, board_sheets.obj and board_wires.obj. A board has CELLS x CELLS cells and one between any two of its LAYERS. A track
is a walk from cell to cell of a layer, of two triangles a cell; a via goes from a corner of a track in one layer to the next ones below,
as long as tracks or nothing are there; a pad is a corner of a track. All lies on one grid, coordinates have at most twelve bits.
"""
import os
import random
import sys


def main():
    folder = sys.argv[1]
    cells, layers, seed = (int(text) for text in sys.argv[2:5] + ["24", "4", "1"][len(sys.argv) - 2:])
    os.makedirs(folder, exist_ok=True)
    pick = random.Random(seed)
    at = lambda i, j, k: (i / 64, j / 64, k / 128)

    def write(name, groups):
        """`groups`: name, kind of element, elements as corners of the grid."""
        numbers = {}
        lines = []
        for group, kind, elements in groups:
            lines.append(f"g {group}\n")
            for corners in elements:
                words = [str(numbers.setdefault(c, len(numbers) + 1)) for c in corners]
                lines.append(f"{kind} {' '.join(words)}\n")
        with open(os.path.join(folder, name), "w") as file:
            file.writelines("v %r %r %r\n" % at(*c) for c in numbers)
            file.writelines(lines)

    def square(c, u, v):
        """Two triangles, counter-clockwise seen from where u turns to v."""
        add = lambda *moves: tuple(c[a] + sum(m == a for m in moves) for a in range(3))
        a, b, d, e = c, add(u), add(u, v), add(v)
        return [(a, b, d), (a, d, e)]
    sides = (cells, cells, layers + 1)
    shell = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for i in range(sides[u]):
            for j in range(sides[v]):
                for end in (0, sides[axis]):
                    c = [0, 0, 0]
                    c[axis], c[u], c[v] = end, i, j
                    shell += [t if end else t[::-1] for t in square(tuple(c), u, v)]
    write("board.obj", [("board", "f", shell)])
    tracks, corners = [], [set() for _ in range(layers)]
    for layer in range(layers):
        taken = set()
        for number in range(cells // 2):
            i, j = pick.randrange(1, cells - 1), pick.randrange(1, cells - 1)
            track = []
            for _ in range(3 * cells):
                if (i, j) not in taken:
                    taken.add((i, j))
                    track.append((i, j, layer + 1))
                # Tracks of even layers run along x most of the time, others along y.
                step = pick.choice((-1, 1))
                i, j = (i + step, j) if (pick.random() < .8) == (layer % 2 == 0) else (i, j + step)
                if not (0 < i < cells - 1 and 0 < j < cells - 1):
                    break
            triangles = [t for c in track for t in square(c, 0, 1)]
            corners[layer] |= {c for t in triangles for c in t}
            if triangles:
                tracks.append((f"track-{layer}-{number}", "f", triangles))
    write("board_sheets.obj", tracks)
    wires, used = [], set()
    for layer in range(1, layers):
        for i, j, k in sorted(pick.sample(sorted(corners[layer]), min(cells, len(corners[layer])))):
            ends = [(i, j, k)]
            while ends[-1][2] > 1 and (i, j) not in used and ends[-1][2] > k - 2:
                ends.append((i, j, ends[-1][2] - 1))
            if len(ends) > 1:
                used.add((i, j))
                wires.append((f"via-{len(wires)}", "l", [tuple(ends)]))
    pads = sorted(pick.sample(sorted(corners[0]), min(2 * cells, len(corners[0]))))
    # Sensors where nothing else is: in the cell between the lowest layer and the board's side.
    probes = [(i + .5, j + .5, .5) for i, j in {(pick.randrange(cells), pick.randrange(cells)) for _ in range(cells)}]
    write("board_wires.obj", [*wires, ("pads", "p", [(c,) for c in pads]), ("probes", "p", [(c,) for c in sorted(probes)])])
    print(f"{len(shell)} triangles, {sum(len(t[2]) for t in tracks)} in {len(tracks)} tracks, {len(wires)} vias, {len(pads)} pads, {len(probes)} probes")


main()
