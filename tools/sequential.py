#!/usr/bin/env python3
"""Meshes in one sub-domain against the same in several: tetrahedra by quality, as the method's paper shows them, and every cut.

    python3 tools/sequential.py [--tetdb PROGRAM] [--subdomains 4] SURFACE...

SURFACE: a file, or a sample (balls,count=100). `FILE@H` first divides the edges of the surface that are longer than H, which may be 1% of the box
diagonal. Populations: all tetrahedra; *unforced* ones, which have no triangle of the surface that makes them bad and a vertex off it; those with a
vertex on an interface. Stores are made in a temporary folder and removed.
"""
import argparse
import json
import os
import subprocess
import tempfile


def run(program, *words):
    done = subprocess.run([program, *words], capture_output=True, text=True)
    if done.returncode not in (0, 7):
        raise SystemExit(f"{' '.join(words)}: exit {done.returncode}\n{done.stderr[-2000:]}")
    return done.stdout


def row(name, seen):
    bins, tets = seen["bins"], seen["tets"]
    shares = " ".join(f"{100 * n / max(tets, 1):9.4f}" for n in bins[:4])
    print(f"  {name:<24} {tets:>11,} {shares} {100 * sum(bins[4:]) / max(tets, 1):9.4f} {seen['worst']:8.3f}")


def cuts(info):
    for entry in info["journal"]:
        if entry["step"] != "bisect":
            continue
        m = {measure["name"]: measure["value"] for measure in entry["measures"]}
        print(f"  cut {m['cut']:.0f}: faces {m['natural_faces']:,.0f} -> {m['interface_faces']:,.0f} (minimum cut {m['minimum_faces']:,.0f}), "
              f"quality {m['natural_face_quality']:.3f} -> {m['interface_face_quality']:.3f}, several faces {m['natural_over_constrained']:,.0f} -> "
              f"{m['over_constrained']:,.0f}, pinched {m['pinched']:.0f}; layers at least {m['layers_least'] or 0:.0f}; "
              f"spheres in the zone {m['z_enclosed']:,.0f} of {m['z_tets']:,.0f}; zone {m['zone_vertices']:,.0f} vertices, "
              f"{m['zone_rejects']:.0f} refused; load low {m['load_low'] / m['load']:.4f}")
    hits = sum(m["value"] for e in info["journal"] for m in e["measures"] if m["name"] == "frozen_hits")
    print(f"  cavities that wanted a frozen tetrahedron: {hits:.0f}")


def case(program, surface, n, folder):
    path, _, h = surface.partition("@")
    if not os.path.exists(path):
        path = f"sample:{path.removeprefix('sample:')}"
    if h:
        fine = os.path.join(folder, "fine.ply")
        run(program, "refine-surface", path, fine, "--hsiz", h)
        path = fine
    stores = [os.path.join(folder, name) for name in ("one.tetdb", "several.tetdb")]
    for store, parts in zip(stores, ("1", str(n))):
        run(program, "mesh", path, "-o", store, "--subdomains", parts, "--json", "--force")
    infos = [json.loads(run(program, "info", store, "--json")) for store in stores]
    told = json.loads(run(program, "compare", *stores, "--json"))
    one, several = told["first"], told["second"]
    change = several["all"]["tets"] / one["all"]["tets"] - 1
    print(f"{surface}: {len(infos[1]['subdomains'])} sub-domains, {100 * change:+.2f} % tetrahedra, {several['interface_faces']:,} interface faces")
    print(f"  {'population':<24} {'tetrahedra':>11} {'q 1-2 %':>9} {'2-3 %':>9} {'3-4 %':>9} {'4-5 %':>9} {'5-':>9} {'worst q':>8}")
    for name, seen in (("one, all", one["all"]), ("several, all", several["all"]), ("one, unforced", one["unforced"]),
                       ("several, unforced", several["unforced"]), ("several, at interfaces", several["at_interface"])):
        row(name, seen)
    cuts(infos[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surface", nargs="+")
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--subdomains", type=int, default=4)
    args = parser.parse_args()
    for surface in args.surface:
        with tempfile.TemporaryDirectory() as folder:
            case(args.tetdb, surface, args.subdomains, folder)


if __name__ == "__main__":
    main()
