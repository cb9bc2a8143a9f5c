#!/usr/bin/env python3
"""Lines of the library that ran, by layer, from gcov's counts. Usage: coverage.py BUILD SOURCES [--ran PROGRAM...] [--json FILE]

BUILD: a build by the preset coverage, whose tests have run. A line that stands in several objects (headers, templates)
ran if it did in one of them. PROGRAM: tests that should have run; BUILD/ran has a file NAME.PART.PARTS for each that did.
Layers of which no test ran are not counted, and said.
"""
import argparse
import concurrent.futures
import json
import pathlib
import subprocess
from collections import defaultdict

LEAST = 90  # per cent; files below are named


def counts_of(counters, sources):
    """{file: {line: ran}} of one object."""
    said = subprocess.run(["gcov", "--json-format", "--stdout", counters.name], cwd=counters.parent, capture_output=True)
    lines = defaultdict(dict)
    for text in said.stdout.splitlines():
        for file in json.loads(text)["files"]:
            path = pathlib.Path(file["file"])
            if not path.is_relative_to(sources):
                continue
            ran = lines[str(path.relative_to(sources))]
            for line in file["lines"]:
                ran[line["line_number"]] = ran.get(line["line_number"], False) or line["count"] > 0
    return lines


def not_run(build, programs):
    """Layers without any test run; and what ran in part, as words."""
    layers, in_part = [], []
    for program in programs:
        parts = list((build / "ran").glob(f"{program}.*"))
        if not parts:
            layers.append(program.removesuffix("_test"))
        elif len(parts) < int(parts[0].name.split(".")[2]):
            in_part.append(f"{len(parts)} of {parts[0].name.split('.')[2]} parts of {program}")
    return layers, in_part


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("sources", type=pathlib.Path)
    parser.add_argument("--ran", nargs="*", default=[])
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    sources = options.sources.resolve()
    # Objects that no test loaded have notes alone: none of their lines ran.
    objects = [note.with_suffix(".gcda") if note.with_suffix(".gcda").exists() else note
               for note in sorted(options.build.resolve().rglob("*.gcno"))]
    files = defaultdict(dict)
    with concurrent.futures.ThreadPoolExecutor() as pool:
        for lines in pool.map(lambda counters: counts_of(counters, sources), objects):
            for name, ran in lines.items():
                for line, did in ran.items():
                    files[name][line] = files[name].get(line, False) or did
    left_out, in_part = not_run(options.build, options.ran)
    layers = defaultdict(lambda: [0, 0])
    below = []
    for name, ran in sorted(files.items()):
        if name.split("/")[0] in left_out:
            continue
        covered = sum(ran.values())
        layer = layers[name.split("/")[0]]
        layer[0] += covered
        layer[1] += len(ran)
        if ran and 100 * covered < LEAST * len(ran):
            below.append({"file": name, "covered": covered, "lines": len(ran)})
    told = {"layers": {name: {"covered": covered, "lines": lines} for name, (covered, lines) in layers.items()},
            "without": left_out, "in_part": in_part,
            "least": LEAST, "below": sorted(below, key=lambda file: file["covered"] / file["lines"])}
    for name, (covered, lines) in [*layers.items(), ("all", [sum(c) for c in zip(*layers.values())])]:
        print(f"{name:10} {covered:7} of {lines:7} lines, {100 * covered / lines:.1f} %")
    for file in told["below"]:
        print(f"  below {LEAST} %: {file['file']}: {file['covered']} of {file['lines']}")
    for words in ([f"no tests of {name}" for name in left_out] + in_part):
        print(f"  ran: {words}")
    if options.json:
        options.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
