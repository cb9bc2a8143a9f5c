#!/usr/bin/python3
"""Writes docs/reliability.md. Usage: reliability.py COUNTS PAGE ROOT

A section, or a row of the fuzzing table, of which COUNTS has nothing stays as it is on the page.
"""
import json
import re
import sys
import textwrap
from collections import defaultdict
from pathlib import Path

NAMED_FILES = 8  # of those with little coverage

counts, page, root = (Path(word) for word in sys.argv[1:4])
old = page.read_text() if page.exists() else ""


def prose(*sentences):
    """Lines of the page, of 100 columns at most."""
    return textwrap.wrap(" ".join(sentences), 100, break_long_words=False, break_on_hyphens=False)


def old_section(title):
    found = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", old, re.MULTILINE | re.DOTALL)
    return found.group(1).strip().splitlines() if found else None


def when_of(name):
    file = counts / f"{name}.when"
    return file.read_text().strip() if file.exists() else ""


def told_by(name):
    file = counts / f"{name}.json"
    return json.loads(file.read_text()) if file.exists() else None


def fuzzing():
    if not (counts / "fuzz").exists():
        return None
    ran = defaultdict(lambda: [0, 0, "", ""])
    for line in (counts / "fuzz").read_text().splitlines():
        name, runs, minutes, status, day, commit = line.split()
        entry = ran[name]
        entry[0] += int(runs)
        entry[1] += int(minutes)
        entry[2:] = ["broke it" if status != "0" else "none broke it", f"{day}, {commit}"]
    rows = {}
    for line in old_section("Fuzzing") or []:
        row = re.match(r"\| `(\w+)` \| ([\d,]+) \|", line)
        if row:
            rows[row[1]] = (int(row[2].replace(",", "")), line)
    for name, (runs, minutes, said, when) in ran.items():
        kept = len(list((root / "tests/fuzz/crashes" / name).glob("*")))
        kept_text = f"; {kept} kept as tests" if kept else ""
        rows[name] = (runs, f"| `{name}` | {runs:,} | {minutes} | {said}{kept_text} | {when} |")
    return [*prose("`scripts/fuzz` runs libFuzzer with the address and undefined-behaviour sanitizers. Inputs that broke a",
                   "target are kept in `tests/fuzz/crashes`, and `scripts/test` replays them."), "",
            "| target | inputs | minutes | result | last run |", "|---|---|---|---|---|",
            *[line for _, (_, line) in sorted(rows.items())],
            f"| all | {sum(runs for runs, _ in rows.values()):,} | | | |"]


def checks():
    if not (counts / "check").exists():
        return None
    rows = {}
    for line in old_section("Checks of the tree") or []:
        row = re.match(r"\| `(.+?)` \| (?:passed|failed) \|", line)
        if row:
            rows[row[1]] = line
    for line in (counts / "check").read_text().splitlines():
        word, ended, minutes, processors, day, commit = line.split()
        rows[word] = f"| `{word}` | {ended} | {minutes} | {processors} | {day}, {commit} |"
    return [*prose("`scripts/check` runs these steps; its first lines explain them. Names after a colon are layers: the step",
                   "ran over these alone. Minutes include building."), "",
            "| step | result | minutes | processors | last run |", "|---|---|---|---|---|",
            *[line for _, line in sorted(rows.items())]]


def properties():
    if not (counts / "properties").exists():
        return None
    tries, when = (counts / "properties").read_text().strip().split(maxsplit=1)
    return prose("`scripts/properties` computes results in two ways, on random meshes, and compares them: with one thread and",
                 "with several; a mesh and the mesh turned; from a file and from memory; packed and plain; points inside by",
                 "scan, by rays and by winding numbers; and more (`tests/properties`).",
                 f"{int(tries):,} tries of each, none failed. Last run: {when}.")


def torture():
    told = told_by("torture")
    if not told:
        return None
    sentences = [sentence for output in told.values() for sentence in output["sentences"]]

    def all_of(count):
        return f"{sum(output[count] for output in told.values()):,}"

    return [*prose("`scripts/torture` disturbs a program while it writes: kills, failing calls (write, fsync, rename, open,",
                   "malloc), full disks, limits of file size and memory, and two writers at once. Afterwards the old file must",
                   "be whole, or the new file there byte for byte. After the next run no other file may be left."),
            "", "| | |", "|---|---|",
            f"| outputs | {', '.join(f'`{name}`' for name in told)} |",
            f"| kills before the program's end | {all_of('kills_struck')} of {all_of('kills')} |",
            f"| failing calls that were reached | {all_of('failures_struck')} of {all_of('failures')} |",
            f"| limits, full disks, two writers | {all_of('limits')} |", f"| wrong results | {len(sentences)} |",
            f"| last run | {when_of('torture')} |",
            *[""] * bool(sentences), *[f"- {sentence}" for sentence in sentences]]


def bounds():
    told = told_by("bounds")
    if not told:
        return None
    marked = lambda growth: f"**{growth:.2f}**" if growth > 2.5 else f"{growth:.2f}"
    return [*prose(f"`scripts/bounds` runs every command on {told['rungs']} meshes. The first has {told['first']:,} vertices,",
                   "each further one twice as many. Processor seconds and MiB are those of the largest mesh. Growth is the",
                   "largest factor between two sizes: 2 is linear, and above 2.5 (bold) the run fails. 0: too small to be",
                   "judged (below 0.3 s, 60 MiB)."), "",
            "| command | seconds | growth | MiB | growth |", "|---|---|---|---|---|",
            *[f"| {name} | {row['seconds'][-1]:.2f} | {marked(row['seconds_growth'])} | {row['mib'][-1]:.0f} | "
              f"{marked(row['mib_growth'])} |" for name, row in told["commands"].items()],
            "", f"Last run: {when_of('bounds')}."]


def mutants():
    told = told_by("mutants")
    if not told:
        return None
    verdicts = judgements()
    same = sum(verdicts.get(f"{m['where'].rsplit(':', 1)[0]}: {m['became']}", "").startswith("changes nothing")
               for m in told["escaped"])
    return [*prose("`scripts/mutate` makes one small change of the library at a time and runs the tests. "
                   f"{told['caught']} of {told['made']} made a test fail, {same} change no result:",
                   f"{100 * told['caught'] / max(1, told['made'] - same):.0f} % of the changes that matter were caught.",
                   "`tests/torture/judged_mutants.json` has a judgement of each that escaped.",
                   f"Last run: {when_of('mutants')}."),
            *[f"- not judged: `{m['where']}`: `{m['became']}`" for m in told["escaped"]]]


def judgements():
    """What was found of mutants that escaped, by file and changed line. One that changes no result begins with "changes
    nothing"."""
    return json.loads((Path(__file__).parent / "judged_mutants.json").read_text())


def judged(section):
    """The same without the mutants that are judged."""
    verdicts = judgements()
    lines = []
    for line in section or []:
        mutant = re.match(r"- not judged: `(.*?):\d+`: `(.*)`$", line)
        if not mutant or f"{mutant[1]}: {mutant[2]}" not in verdicts:
            lines += [""] * (mutant is not None and not lines[-1].startswith("- ")) + [line]
    return lines or None


def coverage():
    told = told_by("coverage")
    if not told:
        return None
    share = lambda part: f"{100 * part['covered'] / part['lines']:.1f} %"
    whole = {key: sum(layer[key] for layer in told["layers"].values()) for key in ("covered", "lines")}
    missed = f"Not counted, as its tests did not run: {', '.join(told['without'])}."
    in_part = f"Ran in part: {', '.join(told['in_part'])}."
    lowest = ", ".join(f"`{file['file']}` {share(file)}" for file in told["below"][:NAMED_FILES])
    return [*prose("`scripts/coverage` counts, by gcov, the lines of the library that run in the tests of its layers and in the",
                   "replay of fuzzed inputs. Tests of the programs, the studio and Python are not counted. Names are those of",
                   "the run's commit."),
            *[missed] * bool(told["without"]), *[in_part] * bool(told["in_part"]), "",
            "| layer | lines | run |", "|---|---|---|",
            *[f"| `{name}` | {layer['lines']:,} | {share(layer)} |" for name, layer in sorted(told["layers"].items())],
            f"| all | {whole['lines']:,} | {share(whole)} |", "",
            *prose(f"Files below {told['least']} %: {len(told['below']) or 'none'}.",
                   *[f"The lowest: {lowest}."] * bool(told["below"]), f"Last run: {when_of('coverage')}.")]


def long_life():
    if not when_of("long_life"):
        return None
    lines = [*prose("`scripts/long-life` repeats work in one process. Repeated results must have the same bytes, and memory must",
                    "not grow. MiB: after a tenth of the run, and at its end."), "",
             "| work | amount | repeated results | MiB | at the end |", "|---|---|---|---|---|"]
    what = {"rounds": "strip, pose, restore", "frames": "simulation"}
    for line in (counts / "long_life").read_text().splitlines():
        name, count, _, compared, _, warm, _, end = line.split()
        lines.append(f"| {what[name]} | {int(count):,} {name} | {int(compared):,}, all the same | {warm} | {end} |")
    return [*lines, "", f"Last run: {when_of('long_life')}."]


def studio():
    if not (counts / "studio").exists():
        return None
    lines = [*prose("`scripts/soak-studio` does random actions in one window after another. It damages files while they are",
                    "open, fills the disk, makes saves fail, and closes windows that work. Whole: nothing failed."), "",
             "| build | result | run |", "|---|---|---|"]
    rows = [line for line in old_section("The studio") or [] if re.match(r"\| \w+ \| .* \| \d", line)]
    for line in (counts / "studio").read_text().splitlines():
        preset, said, when = line.split("|")
        row = f"| {preset} | {said} | {when} |"
        rows += [row] * (row not in rows)
    return lines + rows


def uncovered(sections):
    studio_rows = "\n".join(sections.get("The studio") or [])
    tries = re.search(r"of (\d+)\s+made\s+a\s+test\s+fail", "\n".join(sections.get("Tests of the tests") or []))
    return [*["- The studio's random actions did not run under sanitizers."] * ("| asan |" not in studio_rows),
            *["- No line coverage."] * (not sections.get("Line coverage")),
            *["- Fewer than 200 mutants were tried."] * (not tries or int(tries[1]) < 200),
            "- No run of the studio lasted a day."]


MAKERS = {"Checks of the tree": checks, "Fuzzing": fuzzing, "Properties": properties, "Line coverage": coverage,
          "Torture of outputs": torture, "Bounds": bounds, "Long life": long_life, "The studio": studio,
          "Tests of the tests": mutants}
sections = {title: make() or old_section(title) for title, make in MAKERS.items()}
sections["Tests of the tests"] = judged(sections["Tests of the tests"])
sections["Limits"] = uncovered(sections)
lines = ["# Reliability", "",
         *prose("Which checks ran, when, and what they found. For readers who decide whether to trust Filigree, and for",
                "developers. `scripts/reliability` writes this page from the counts of the last runs; do not edit it by hand."), "",
         "    scripts/check            # what every change has to pass",
         "    scripts/fuzz             # one of the longer searches below",
         "    scripts/reliability      # then writes this page", "",
         "A run is named by its date and its commit.", ""]
for title, text in sections.items():
    if text:
        lines += [f"## {title}", "", *text, ""]
page.write_text("\n".join(lines))
