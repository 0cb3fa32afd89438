"""Adds a chapter of pictures to the sources of a book: `gallery.py PROGRAM FOLDER [H]`.

Each picture is drawn by the commands beside it, from surfaces that the program generates, so all of them can be repeated. H is the edge
length of the largest mesh: 0.004 gives some 75 million tetrahedra in minutes, 0.02 less than a million in seconds.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

SIZE = "--size 1200x900"
# Cuts are drawn away from the interfaces, which lie near middles: along one, a cut is a patchwork of both sides.
# Title, text, name, commands. The store that is counted is NAME.tetdb, and the last command draws NAME.png.
PICTURES = [
    ("Many bodies", "Forty empty balls in a cube. Every triangle of their surfaces is a face of the mesh.", "balls",
     ["mesh sample:balls,count=40,seed=5 -o balls.tetdb", "snapshot balls.tetdb balls.png --surface --plane 0.5,0.5,0.5,1,0.2,0.3 --from 1,0.5,0.4"]),
    ("A cut through a large mesh", "Sub-domains of a mesh that need not fit in memory. The cut reads only what its plane meets.", "large",
     ["mesh sample:balls,count=300,h={h} -o large.tetdb --memory 1GiB --subdomains 16 --no-verify", "snapshot large.tetdb large.png --plane 0.5,0.37,0.5,0,-1,0 --crinkle"]),
    ("Bodies and what is between them", "Balls, each a region of its own, and the region around them. Where materials meet, they share faces.", "inclusions",
     ["mesh sample:balls,count=60,seed=3 -o inclusions.tetdb --regions all", "snapshot inclusions.tetdb inclusions.png --surface --plane 0.5,0.5,0.5,1,0.3,0.2 --from 1,0.4,0.4 --color region"]),
    ("Grains", "Convex grains, each a region of its own, in a cut that leaves tetrahedra whole.", "grains",
     ["mesh sample:grains,count=30 -o grains.tetdb --regions all", "snapshot grains.tetdb grains.png --color region --crinkle"]),
    ("Sub-domains", "A knot in four sub-domains. A parallel solver takes one each.", "knot",
     ["mesh sample:knot,h=0.045 -o knot.tetdb --subdomains 4", "snapshot knot.tetdb knot.png --surface --color subdomain"]),
    ("An interface", "Faces that two sub-domains share, chosen among those of the mesh before it was cut.", "interface",
     ["mesh sample:box,h=0.05 -o interface.tetdb --subdomains 2 --keep-stages", "snapshot interface.tetdb interface.png --stage 1:interface"]),
    ("One sub-domain meshed again", "Half the lengths in sub-domain 1 of four. Interfaces and the other three stay as they were.", "again",
     ["mesh sample:box,h=0.04 -o again.tetdb --subdomains 4", "resaturate again.tetdb --subdomain 1 --refine-by 0.5",
      "snapshot again.tetdb again.png --plane 0.4,0.5,0.5,1,0,0 --crinkle"]),
    ("Adapted to a field", "A field with a steep front, and the mesh that is best for its values, for a wanted number of tetrahedra.", "adapted",
     ["mesh sample:box,h=0.06 -o adapted.tetdb",
      "field adapted.tetdb add u --at vertices --from '1/(1+exp(40*(sqrt((x-0.5)^2+(y-0.5)^2+(z-0.5)^2)-0.3)))'",
      "adapt adapted.tetdb --field u --tets 150k", "snapshot adapted.tetdb adapted.png --plane 0.5,0.5,0.5,0,0,1 --crinkle --color u"]),
    ("Sizes", "Edges of 0.02 in a ball, at most 0.15 away from it.", "sizes",
     ["mesh sample:box,h=0.15 -o sizes.tetdb --refine-surface --size-sphere 0.5,0.5,0.5,0.15,0.02,0.15", "snapshot sizes.tetdb sizes.png --color size --crinkle"]),
    ("A network of faults", "Faults that cut each other and end inside a block of rock: the tetrahedra on both sides of them.", "faults",
     ["sample faults,count=9,cells=40,seed=5 -o faults.obj", "mesh faults.obj --embed faults_sheets.obj -o faults.tetdb",
      "query faults.tetdb --touching-sheet -o near.vtu", "import near.vtu -o near.tetdb", "snapshot near.tetdb faults.png --surface --from 0.4,1,0.6"]),
    ("Layers and wells", "Layers of rock, a region each. Edges of the mesh run along the wells, and sensors are vertices.", "wells",
     ["sample wells,count=12,cells=16 -o wells.obj",
      "mesh wells.obj wells_sheets.obj --regions all --embed-edges wells_wires.obj --embed-points wells_wires.obj -o wells.tetdb",
      "snapshot wells.tetdb wells.png --surface --plane 0.5,0.5,0.5,1,0.2,0.1 --from 1,0.3,0.3 --color region"]),
    ("A repaired surface", "Nine boxes that go through each other, as one body. Each keeps its color; edges run where they crossed.", "repaired",
     ["sample broken,kind=crossings,count=9,seed=4 -o boxes.obj", "mesh boxes.obj --repair winding -o repaired.tetdb",
      "snapshot repaired.tetdb repaired.png --surface --color label"]),
]  # fmt: skip


def main(program: str, folder: str, h: str = "0.004") -> None:
    source, parts = Path(folder) / "src", ["# Gallery\n"]
    with tempfile.TemporaryDirectory() as work:

        def run(command: str) -> str:
            return subprocess.run([os.path.abspath(program), *shlex.split(command)], cwd=work, check=True, stdout=subprocess.PIPE, text=True).stdout

        for title, text, name, templates in PICTURES:
            commands = [command.replace("{h}", h) for command in templates]
            commands[-1] += f" {SIZE}"
            for command in commands:
                run(f"{command} --quiet")
            found = json.loads(run(f"info {name}.tetdb --json"))
            os.replace(Path(work) / f"{name}.png", source / "pictures" / f"gallery_{name}.png")
            count = f"{found['tets']:,} tetrahedra"
            # An option a line, since a browser breaks lines behind hyphens.
            lines = "\n".join(f"$ tetdb {command}".replace(" -", " \\\n    -") for command in commands)
            picture = f"![{title}](pictures/gallery_{name}.png)"
            parts.append(f'## {title}\n\n{text}\n\n<div class="shown">\n\n{picture}\n\n<div>\n\n{count}\n\n```console\n{lines}\n```\n\n</div>\n</div>\n')
    (source / "gallery.md").write_text("\n".join(parts))
    summary = source / "SUMMARY.md"
    summary.write_text(summary.read_text().replace("[tetdb](index.md)\n", "[tetdb](index.md)\n\n[Gallery](gallery.md)\n"))


if __name__ == "__main__":
    main(*sys.argv[1:])
