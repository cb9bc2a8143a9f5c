#!/usr/bin/env python3
"""Tests of the tests: makes one small change of the library at a time, and sees whether a test fails.

Usage: mutate.py TREE [--count N] [--seed S] [--json FILE]
TREE is a checkout that may be changed, with build/release configured. Changes are of arithmetic, comparisons, logic and
constants in the layers below. One that does not compile is passed over.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys

LAYERS = {  # and the tests that judge them, quick ones first
    "hierarchy": ["hierarchy_test", "properties_test"],
    "sample": ["sample_test", "properties_test"],
    "coding": ["coding_test", "properties_test"],
    "fracture": ["fracture_test"],
}
CHANGES = [
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " + "), (r" / ", " * "), (r" < ", " <= "), (r" <= ", " < "),
    (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
    (r"std::min\(", "std::max("), (r"std::max\(", "std::min("), (r"\+\+", "--"), (r"\b1\b", "2"), (r"\b0\b", "1"),
]
NO_CODE = re.compile(r"^\s*(//|#|\*|using|template|namespace|static_assert|struct|class|enum)|Error\{|\"|report\(|reserve\(")


def sites(tree):
    found = []
    for layer in LAYERS:
        for path in sorted((tree / "src/filigree" / layer).glob("*.cpp")):
            for number, line in enumerate(path.read_text().splitlines()):
                code = line.split("//")[0]
                if NO_CODE.search(code):
                    continue
                for pattern, text in CHANGES:
                    if "template" in code or (" < " in pattern and "<" in code.replace(" < ", "")):
                        continue
                    found += [(layer, path, number, m.start(), m.end(), text) for m in re.finditer(pattern, code)]
    return found


def is_caught(tree, tests):
    """None: it does not compile."""
    build = tree / "build/release"
    if subprocess.run(["cmake", "--build", build, "--target", *tests], capture_output=True).returncode != 0:
        return None
    for test in tests:
        try:
            done = subprocess.run([build / "bin" / test, "--gtest_fail_fast", "--gtest_brief=1"], cwd=tree,
                                  capture_output=True, timeout=400)
        except subprocess.TimeoutExpired:
            return "does not end"
        if done.returncode != 0:
            return test
    return ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tree", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    tree = options.tree.resolve()
    choice = random.Random(options.seed)
    by_layer = {layer: [site for site in sites(tree) if site[0] == layer] for layer in LAYERS}
    told = {"seed": options.seed, "made": 0, "caught": 0, "escaped": []}
    while told["made"] < options.count:
        layer, path, number, begin, end, text = choice.choice(by_layer[list(LAYERS)[told["made"] % len(LAYERS)]])
        whole = path.read_text()
        lines = whole.splitlines(keepends=True)
        was = lines[number]
        lines[number] = was[:begin] + text + was[end:]
        path.write_text("".join(lines))
        try:
            by = is_caught(tree, LAYERS[layer])
        finally:
            path.write_text(whole)
        if by is None:
            continue
        told["made"] += 1
        told["caught"] += by != ""
        where = f"{path.relative_to(tree)}:{number + 1}"
        if by == "":
            told["escaped"].append({"where": where, "was": was.strip(), "became": lines[number].strip()})
        print(f"mutate: {told['made']:3}  {where}: {lines[number].strip()}\n             {by or 'ESCAPED'}", flush=True)
        if options.json:
            options.json.write_text(json.dumps(told, indent=1))
    print(f"mutate: {told['caught']} of {told['made']} were caught")


if __name__ == "__main__":
    sys.exit(main())
