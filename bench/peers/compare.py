"""Prints the peers' figures, and ours beside them as ratios: above 1 is in our favour.

    compare.py PEERS [OURS...]

PEERS: lines "name value unit". OURS: what `filigree bench --json` prints, {"results": [{"name", "value", "unit"}, ...]},
and what `filigree sample --method scan --json` prints, each for another lattice: "inside.scan_N" has N points along the
longest side; and what `filigree fracture --json` prints, with the choice of seeds and all naming of pieces in its time.
Rates (…/s) are better high, all else (s, bytes) better low; a pair is shown when both sides were measured.
"""
import json
import sys

# what, ours, theirs
PAIRS = [
    ("restore, float / stencils", "restore.float", "opensubdiv.stencils"),
    ("restore, float / level by level", "restore.float", "opensubdiv.levels"),
    ("restore, float / Surface Deform, a frame", "restore.float", "blender.surface_deform_frame"),
    ("restore, float / Surface Deform, its own part", "restore.float", "blender.surface_deform"),
    ("restore, float / decode float (a ceiling)", "restore.float", "meshoptimizer.decode_float"),
    ("restore, regular, reference code / stencils", "restore.reference", "opensubdiv.stencils"),
    ("restore, regular, reference code / level by level", "restore.reference", "opensubdiv.levels"),
    ("simplify / simplify", "strip.simplify", "meshoptimizer.simplify"),
    ("simplify / Lindstrom-Turk", "strip.simplify", "cgal.simplify_lindstrom_turk"),
    ("simplify / Garland-Heckbert", "strip.simplify", "cgal.simplify_garland_heckbert"),
    ("strip / decimate + bind", "strip.total", "blender.decimate_and_bind"),
    ("handles, set-up", "handles.setup", "cgal.arap_setup"),
    ("handles, an iteration", "handles.iteration", "cgal.arap_iteration"),
    ("8,000 particles, a frame / neo-Hookean, implicit", "simulate.cube.frame", "bullet.neo_hookean_implicit"),
    ("8,000 particles, a frame / neo-Hookean, explicit", "simulate.cube.frame", "bullet.neo_hookean_explicit"),
    ("8,000 particles, springs / links, 10 iterations", "simulate.springs_stiff.frame", "bullet.springs"),
    ("200 rigid pieces fall into a heap, a frame / Bullet", "simulate.heap.falling", "bullet.heap_falling"),
    ("the heap at rest, a frame / Bullet", "simulate.heap.resting", "bullet.heap_resting"),
    ("koala in 20 pieces, rough / Cell Fracture, planes", "fracture.seconds", "cellfracture.seconds"),
]
for bits in (12, 14):
    for level in (7, 10):
        PAIRS += [
            (f"coded at {bits} bits / Draco -cl {level}", f"coding.{bits}_bits", f"draco.cl{level}_{bits}_bits"),
            (f"decoding at {bits} bits / Draco -cl {level}", f"coding.{bits}_decode", f"draco.cl{level}_{bits}_decode"),
        ]
    PAIRS += [
        (f"stream at {bits} bits / Draco -cl 7", f"coding.stream_{bits}_bits", f"draco.cl7_{bits}_bits"),
        (f"decoding a stream at {bits} bits / Draco -cl 7", f"coding.stream_{bits}_decode", f"draco.cl7_{bits}_decode"),
    ]
for n in (64, 128, 256, 512):
    PAIRS += [
        (f"inside, {n}: scan / CGAL, exact", f"inside.scan_{n}", f"inside.cgal_{n}"),
        (f"inside, {n}: scan / Embree, a ray a row", f"inside.scan_{n}", f"inside.embree_rows_{n}"),
        (f"inside, {n}: scan / Embree, shot again at each hit", f"inside.scan_{n}", f"inside.embree_again_{n}"),
        (f"inside, {n}: scan / Embree, a ray a point", f"inside.scan_{n}", f"inside.embree_points_{n}"),
        (f"inside, {n}: scan / all triangles in a loop", f"inside.scan_{n}", f"inside.plain_{n}"),
    ]


def read_peers(path):
    figures = {}
    with open(path, encoding="utf-8") as lines:
        for name, value, unit in (line.split() for line in lines):
            figures[name] = (float(value), unit)
    if {"blender.decimate", "blender.bind"} <= figures.keys():
        figures["blender.decimate_and_bind"] = (figures["blender.decimate"][0] + figures["blender.bind"][0], "s")
    return figures


def read_ours(paths):
    figures = {}
    for path in paths:
        with open(path, encoding="utf-8") as file:
            said = json.load(file)
        if "results" in said:
            figures |= {figure["name"]: (figure["value"], figure["unit"]) for figure in said["results"]}
        elif "cone_facets" in said:
            figures["fracture.seconds"] = (said["seconds"]["total"], "s")
        else:
            figures[f"inside.scan_{max(said['lattice'])}"] = (said["tested"] / said["seconds"], "points/s")
    return figures


def main():
    peers = read_peers(sys.argv[1])
    ours = read_ours(sys.argv[2:])

    print(f"{'peer':<34} {'figure':>12}")
    for name, (value, unit) in peers.items():
        print(f"{name:<34} {value:>12.4g} {unit}")
    shown = [(what, ours[mine], peers[theirs]) for what, mine, theirs in PAIRS if mine in ours and theirs in peers]
    if not shown:
        return
    print(f"\n{'ours / theirs':<52} {'ours':>10} {'theirs':>10} {'ratio':>8}")
    for what, (mine, unit), (theirs, their_unit) in shown:
        if unit != their_unit:
            sys.exit(f"{what}: ours is in {unit}, theirs in {their_unit}")
        ratio = mine / theirs if unit.endswith("s/s") else theirs / mine
        print(f"{what:<52} {mine:>10.4g} {theirs:>10.4g} {ratio:>8.3g}  {unit}")


main()
