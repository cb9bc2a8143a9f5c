#!/usr/bin/python3
"""Writes docs/reliability.md. Usage: reliability.py COUNTS PAGE ROOT

A section, or a row of the fuzzing table, of which COUNTS has nothing stays as it is on the page.
"""
import json
import re
import sys
from collections import defaultdict
from pathlib import Path

counts, page, root = (Path(word) for word in sys.argv[1:4])
old = page.read_text() if page.exists() else ""


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
    return ["libFuzzer with the address and undefined-behaviour sanitizers (`scripts/fuzz`). What broke a target lies in "
            "`tests/fuzz/crashes` and is replayed by `scripts/test`.", "",
            "| target | inputs | minutes | in the last run | last run |", "|---|---|---|---|---|",
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
    return ["`scripts/check` over everything, or over the layers behind the colon; with building what was not built.", "",
            "| step | | minutes | processors | last run |", "|---|---|---|---|---|", *[line for _, line in sorted(rows.items())]]


def properties():
    if not (counts / "properties").exists():
        return None
    tries, when = (counts / "properties").read_text().strip().split(maxsplit=1)
    return ["What has to come out the same two ways on random meshes (`tests/properties`: threads, order, turned, file and "
            "memory, coded and plain, scan, rays and winding, pieces and whole, bodies): "
            f"{int(tries):,} tries of each with `scripts/properties`, none failed. Last run: {when}."]


def torture():
    told = told_by("torture")
    if not told:
        return None
    sentences = [sentence for output in told.values() for sentence in output["sentences"]]

    def all_of(count):
        return f"{sum(output[count] for output in told.values()):,}"

    return ["Outputs under kills (before every call that changes a file, where memory is asked for, and by the clock), failing "
            "calls (write, fsync, rename, open, malloc), full disks, file-size and memory limits, and two writers at once "
            "(`scripts/torture`). Afterwards the old file has to be there whole or the new one byte for byte, and after the next "
            "run nothing beside it.", "", "| | |", "|---|---|",
            f"| outputs | {', '.join(f'`{name}`' for name in told)} |",
            f"| kills that struck before the end | {all_of('kills_struck')} of {all_of('kills')} |",
            f"| failing calls that struck | {all_of('failures_struck')} of {all_of('failures')} |",
            f"| limits, full disks, rival writers | {all_of('limits')} |", f"| wrong | {len(sentences)} |",
            f"| last run | {when_of('torture')} |",
            *[""] * bool(sentences), *[f"- {sentence}" for sentence in sentences]]


def bounds():
    told = told_by("bounds")
    if not told:
        return None
    marked = lambda growth: f"**{growth:.2f}**" if growth > 2.5 else f"{growth:.2f}"
    return [f"Every command over {told['rungs']} meshes from {told['first']:,} vertices on, each twice the one before "
            "(`scripts/bounds`): processor seconds (of a machine as fast as in the middle of the run) and memory of the largest, and the most that either grew at a step. 2.5 is "
            "the limit, and what is beyond it is in bold; steps below 0.3 s and 60 MiB are not judged (0).", "",
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
    escaped = ["", "What escaped:", "", *[f"- `{m['where']}`: `{m['became']}`" for m in told["escaped"]]]
    runs = ", ".join(f"{made} of seed {seed}" for seed, made in told["seeds"].items())
    return [f"Small changes of hierarchy, sample, coding and fracture, one at a time (`scripts/mutate`; {runs}): "
            f"{told['caught']} of {told['made']} made a test fail, {same} of the others change nothing, as judged below: "
            f"{100 * told['caught'] / max(1, told['made'] - same):.0f} % of those that change something were caught. "
            f"Last run: {when_of('mutants')}.",
            *(escaped if told["escaped"] else [])]


def judgements():
    """What was found of mutants that escaped, by file and changed line. One that changes no result begins with "changes
    nothing"."""
    return json.loads((Path(__file__).parent / "judged_mutants.json").read_text())


def judged(section):
    """The same, behind each."""
    verdicts = judgements()
    lines = []
    for line in section or []:
        mutant = re.match(r"- `(.*?):\d+`: `(.*?)`", line)
        verdict = mutant and verdicts.get(f"{mutant[1]}: {mutant[2]}")
        lines.append(f"{mutant[0]}: {verdict}" if verdict else line)
    return lines or None


def coverage():
    told = told_by("coverage")
    if not told:
        return None
    share = lambda part: f"{100 * part['covered'] / part['lines']:.1f} %"
    whole = {key: sum(layer[key] for layer in told["layers"].values()) for key in ("covered", "lines")}
    missed = told["without"] and f" Not counted, as its tests did not run: {', '.join(told['without'])}."
    in_part = told["in_part"] and f" Ran in part: {', '.join(told['in_part'])}."
    return ["Lines of the library that the tests of its layers and the fuzz targets' replay run, by gcov (`scripts/coverage`). "
            "Tests of the programs, the studio and Python run more of them, and are not counted."
            + (missed or "") + (in_part or ""), "",
            "| layer | lines | run |", "|---|---|---|",
            *[f"| `{name}` | {layer['lines']:,} | {share(layer)} |" for name, layer in sorted(told["layers"].items())],
            f"| all | {whole['lines']:,} | {share(whole)} |", "",
            f"Files below {told['least']} %: " + (", ".join(f"`{file['file']}` {share(file)}" for file in told["below"]) or "none")
            + f". Last run: {when_of('coverage')}."]


def long_life():
    if not when_of("long_life"):
        return None
    lines = ["One process (`scripts/long-life`), memory in MiB after a tenth of the way and at the end. What comes again has to "
             "have the bytes that it had.", "", "| | | compared with before | memory | at the end |", "|---|---|---|---|---|"]
    what = {"rounds": "strip, pose, restore", "frames": "simulation"}
    for line in (counts / "long_life").read_text().splitlines():
        name, count, _, compared, _, warm, _, end = line.split()
        lines.append(f"| {what[name]} | {int(count):,} {name} | {int(compared):,}, all the same | {warm} | {end} |")
    return [*lines, "", f"Last run: {when_of('long_life')}."]


def studio():
    if not (counts / "studio").exists():
        return None
    lines = ["Random actions in one window after another; files damaged while they are open, full disks, saves that cannot be, "
             "windows closed while they work (`scripts/soak-studio`).", "", "| build | | run |", "|---|---|---|"]
    rows = [line for line in old_section("The studio") or [] if re.match(r"\| \w+ \| .* \| \d", line)]
    for line in (counts / "studio").read_text().splitlines():
        preset, said, when = line.split("|")
        row = f"| {preset} | {said} | {when} |"
        rows += [row] * (row not in rows)
    return lines + rows


def uncovered(sections):
    studio_rows = "\n".join(sections.get("The studio") or [])
    tries = re.search(r"of (\d+) made a test fail", "\n".join(sections.get("Tests of the tests") or []))
    return [*["- The studio's hours of random actions were not under sanitizers."] * ("| asan |" not in studio_rows),
            *["- No line coverage."] * (not sections.get("Line coverage")),
            *["- Two hundred mutants were aimed at; see how many were tried."] * (not tries or int(tries[1]) < 200),
            "- No soak of a day."]


MAKERS = {"Checks of the tree": checks, "Fuzzing": fuzzing, "Properties": properties, "Line coverage": coverage,
          "Torture of outputs": torture, "Bounds": bounds, "Long life": long_life, "The studio": studio,
          "Tests of the tests": mutants}
sections = {title: make() or old_section(title) for title, make in MAKERS.items()}
sections["Tests of the tests"] = judged(sections["Tests of the tests"])
sections["What nothing covers"] = uncovered(sections)
lines = ["# Reliability", "",
         "Written by `scripts/reliability` from what `scripts/check`, `fuzz`, `properties`, `coverage`, `torture`, `bounds`, "
         "`long-life`, `soak-studio` and `mutate` counted last; not by hand.", ""]
for title, text in sections.items():
    if text:
        lines += [f"## {title}", "", *text, ""]
page.write_text("\n".join(lines))
