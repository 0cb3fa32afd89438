"""Adds a chapter of pictures to the sources of a book: `gallery.py PROGRAM FOLDER`.

Each picture is drawn by the commands below it, from surfaces that the program generates, so all of them can be repeated.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

SIZE = "--size 1200x900"
PICTURES = [
    ("Many bodies", "Forty empty balls in a cube. Every triangle of their surfaces is a face of the mesh.", "balls",
     ["mesh sample:balls,count=40,seed=5 -o balls.tetdb", "snapshot balls.tetdb balls.png --surface --plane 0.5,0.5,0.5,1,0.2,0.3 --from 1,0.5,0.4"]),
    ("Regions", "Convex grains, each a region of its own, and the box around them.", "grains",
     ["mesh sample:grains,count=30 -o grains.tetdb --regions all", "snapshot grains.tetdb grains.png --color region --crinkle"]),
    ("Sub-domains", "A knot in four sub-domains. A parallel solver takes one each.", "knot",
     ["mesh sample:knot,h=0.045 -o knot.tetdb --subdomains 4", "snapshot knot.tetdb knot.png --surface --color subdomain"]),
    ("Sizes", "Edges of 0.02 in a ball, at most 0.15 away from it.", "sizes",
     ["mesh sample:box,h=0.15 -o sizes.tetdb --refine-surface --size-sphere 0.5,0.5,0.5,0.15,0.02,0.15", "snapshot sizes.tetdb sizes.png --color size"]),
    ("Sheets", "Faults that cut each other and end inside a block of rock.", "faults",
     ["sample faults,cells=28 -o faults.obj", "mesh faults.obj --embed faults_sheets.obj -o faults.tetdb", "snapshot faults.tetdb faults.png --crinkle --color quality"]),
    ("An interface", "Faces that two sub-domains share, chosen among those of the mesh before it was cut.", "interface",
     ["mesh sample:box,h=0.05 -o interface.tetdb --subdomains 2 --keep-stages", "snapshot interface.tetdb interface.png --stage 1:interface"]),
]  # fmt: skip


def main(program: str, folder: str) -> None:
    source, parts = Path(folder) / "src", ["# Gallery\n"]
    with tempfile.TemporaryDirectory() as work:
        for title, text, name, commands in PICTURES:
            commands[-1] += f" {SIZE}"
            for command in commands:
                subprocess.run([os.path.abspath(program), *shlex.split(command), "--quiet"], cwd=work, check=True)
            os.replace(Path(work) / f"{name}.png", source / "pictures" / f"gallery_{name}.png")
            lines = "\n".join(f"$ tetdb {command}" for command in commands)
            parts.append(f"## {title}\n\n{text}\n\n![{title}](pictures/gallery_{name}.png)\n\n```console\n{lines}\n```\n")
    (source / "gallery.md").write_text("\n".join(parts))
    summary = source / "SUMMARY.md"
    summary.write_text(summary.read_text().replace("[tetdb](index.md)\n", "[tetdb](index.md)\n\n[Gallery](gallery.md)\n"))


if __name__ == "__main__":
    main(*sys.argv[1:])
