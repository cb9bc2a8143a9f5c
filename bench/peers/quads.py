"""Ours and Blender's QuadriFlow on the same meshes, measured by the same program; prints two tables in Markdown.

    quads.py FILIGREE CORPUS WORK [--quads N ...] [--meshes NAME ...] [--limit SECONDS] [--keep-blender]

Both remesh one mesh after the other, with all threads. Seconds are of the remeshing alone. What is written is then read by
`filigree info` (irregular vertices, scaled Jacobian) and `filigree compare` (distances, 100,000 samples a surface).
--keep-blender: takes Blender's quads and seconds from an earlier run in WORK, where it has them.
"""
import argparse
import json
import math
import pathlib
import subprocess

MESHES = [
    "koala_100k.obj", "fish.obj", "penguin.obj", "mountain_open.obj", "plane_holes.obj", "torus.obj", "featuretype.STL",
    "quadknot.obj", "sword_quad_dominant.obj", "spot_low.obj", "moon.glb",
]  # fmt: skip
BLENDER_SCRIPT = pathlib.Path(__file__).parent / "blender_quadriflow.py"


class Failed(Exception):
    """What stopped a remesher, in a few words."""


def run(command, limit=None):
    try:
        return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        raise Failed(f"nothing within {limit:g} s") from None


def run_json(command, limit=None):
    ran = run(command, limit)
    if ran.returncode != 0:
        reason = (ran.stderr.strip().splitlines() or ["no reason"])[-1]
        raise Failed(f"code {ran.returncode}: {reason.removeprefix('filigree: ')}")
    return json.loads(ran.stdout)


def remesh_ours(options, mesh, count, out):
    said = run_json([options.filigree, "remesh", mesh, "-o", out, "--quads", count, "--json", "--quiet"], options.limit)
    return said["seconds"]["remesh"]


def remesh_blender(options, mesh, count, out):
    seconds = out.with_suffix(".seconds")
    if not (options.keep_blender and seconds.exists()):
        plain = options.work / (mesh.stem + ".ply")
        run_json([options.filigree, "deform", mesh, "--stretch", 1, "-o", plain, "--json", "--quiet"])
        out.unlink(missing_ok=True)
        try:
            ran = run(
                ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", BLENDER_SCRIPT]
                + ["--", plain, "-o", out, "--quads", count],
                options.limit,
            )
            words = [line.split(maxsplit=1) for line in ran.stdout.splitlines() if line.startswith(("seconds ", "refused "))]
            seconds.write_text(" ".join(words[-1]) if words else f"refused crashed, code {ran.returncode}")
        except Failed as failed:
            seconds.write_text(f"refused {failed}")
    word, value = seconds.read_text().split(maxsplit=1)
    if word == "refused":
        raise Failed(value)
    return float(value)


def measure(options, quads, mesh):
    info = run_json([options.filigree, "info", quads, "--json", "--quiet"])
    distance = run_json([options.filigree, "compare", quads, mesh, "--json", "--quiet"])
    quality = info["quad_quality"]
    return {
        "quads": info["quads"],
        "irregular": quality["irregular_vertices"],
        "sj_min": quality["scaled_jacobian"]["min"],
        "sj_mean": quality["scaled_jacobian"]["mean"],
        "inverted": quality["inverted"],
        "out": (distance["rms_a_to_b"], distance["max_a_to_b"]),
        "back": (distance["rms_b_to_a"], distance["max_b_to_a"]),
    }


COLUMNS = [  # title, of a measurement
    ("s", lambda m: f"{m['seconds']:.3g}"),
    ("quads", lambda m: f"{m['quads']:,}"),
    ("irregular", lambda m: f"{m['irregular']:,}"),
    ("SJ, least", lambda m: f"{m['sj_min']:.2f}"),
    ("SJ, mean", lambda m: f"{m['sj_mean']:.3f}"),
    ("inverted", lambda m: f"{m['inverted']:,}"),
    ("from input, rms", lambda m: f"{m['back'][0]:.1e}"),
    ("from input, max", lambda m: f"{m['back'][1]:.1e}"),
    ("to input, max", lambda m: f"{m['out'][1]:.1e}"),
]


def row(name, ours, theirs):
    def cell(value, m):
        return value(m) if m else "-"

    return f"| {name} | " + " | ".join(f"{cell(value, ours)}, {cell(value, theirs)}" for _, value in COLUMNS) + " |"


def summary(count, results):
    """Geometric means of what both did, and what each failed at."""
    both = [(ours, theirs) for ours, theirs in results if ours and theirs]
    print(f"\n{count:,} quads: of {len(results)} meshes ours did {sum(bool(o) for o, _ in results)}, ", end="")
    print(f"QuadriFlow {sum(bool(t) for _, t in results)}.")

    def mean_ratio(value):
        ratios = [value(theirs) / value(ours) for ours, theirs in both if value(ours) > 0 and value(theirs) > 0]
        return math.exp(sum(map(math.log, ratios)) / len(ratios)) if ratios else float("nan")

    if both:
        print(f"QuadriFlow / ours, geometric means over the {len(both)} that both did: seconds {mean_ratio(lambda m: m['seconds']):.3g}, ", end="")
        print(f"irregular vertices {mean_ratio(lambda m: m['irregular']):.2g}, ", end="")
        print(f"rms from the input {mean_ratio(lambda m: m['back'][0]):.2g}, max {mean_ratio(lambda m: m['back'][1]):.2g}; ", end="")
        print(f"inverted quads, all: ours {sum(o['inverted'] for o, _ in both)}, QuadriFlow {sum(t['inverted'] for _, t in both)}.")


def main():
    parser = argparse.ArgumentParser(prog="quads")
    parser.add_argument("filigree", type=pathlib.Path)
    parser.add_argument("corpus", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--quads", type=int, nargs="+", default=[5_000, 50_000])
    parser.add_argument("--meshes", nargs="+", default=MESHES)
    parser.add_argument("--limit", type=float, default=300, help="seconds a mesh")
    parser.add_argument("--keep-blender", action="store_true")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)

    for count in options.quads:
        print(f"\nAbout {count:,} quads; each ours, QuadriFlow:\n")
        print("| mesh | " + " | ".join(title for title, _ in COLUMNS) + " |")
        print("|---" * (len(COLUMNS) + 1) + "|")
        results, failures = [], []
        for name in options.meshes:
            mesh = options.corpus / "good" / name
            found = []
            for who, remesh in (("ours", remesh_ours), ("QuadriFlow", remesh_blender)):
                out = options.work / f"{mesh.stem}-{count}-{who}.ply"
                try:
                    seconds = remesh(options, mesh, count, out)
                    found.append(measure(options, out, mesh) | {"seconds": seconds})
                except Failed as failed:
                    failures.append(f"{mesh.stem}, {who}: {failed}")
                    found.append(None)
            print(row(mesh.stem, *found), flush=True)
            results.append(tuple(found))
        print("\n" + "\n".join(failures))
        summary(count, results)


main()
