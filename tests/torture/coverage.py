#!/usr/bin/env python3
"""Lines of the library that ran, by layer, from gcov's counts. Usage: coverage.py BUILD SOURCES [--json FILE]

BUILD: a build by the preset coverage, whose tests have run. A line that stands in several objects (headers, templates)
ran if it did in one of them.
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


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("sources", type=pathlib.Path)
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
    layers = defaultdict(lambda: [0, 0])
    below = []
    for name, ran in sorted(files.items()):
        covered = sum(ran.values())
        layer = layers[name.split("/")[0]]
        layer[0] += covered
        layer[1] += len(ran)
        if ran and 100 * covered < LEAST * len(ran):
            below.append({"file": name, "covered": covered, "lines": len(ran)})
    told = {"layers": {name: {"covered": covered, "lines": lines} for name, (covered, lines) in layers.items()},
            "without": (options.build / "not_run").read_text().splitlines() if (options.build / "not_run").exists() else [],
            "least": LEAST, "below": sorted(below, key=lambda file: file["covered"] / file["lines"])}
    for name, (covered, lines) in [*layers.items(), ("all", [sum(c) for c in zip(*layers.values())])]:
        print(f"{name:10} {covered:7} of {lines:7} lines, {100 * covered / lines:.1f} %")
    for file in told["below"]:
        print(f"  below {LEAST} %: {file['file']}: {file['covered']} of {file['lines']}")
    if options.json:
        options.json.write_text(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
