#!/usr/bin/python3
"""Writes docs/reliability.md. Usage: reliability.py COUNTS PAGE ROOT"""
import json, sys
from collections import defaultdict
from pathlib import Path

counts, page, root = (Path(word) for word in sys.argv[1:4])
lines = ['# Reliability', '',
         'Written by `scripts/reliability` from what `scripts/fuzz`, `properties`, `torture`, `bounds` and `mutate` counted last; not by hand.', '']

executions = defaultdict(lambda: [0, 0, '', ''])
if (counts / 'fuzz').exists():
    for line in (counts / 'fuzz').read_text().splitlines():
        name, runs, minutes, status, day, commit = line.split()
        entry = executions[name]
        entry[0] += int(runs)
        entry[1] += int(minutes)
        entry[2:] = ['broke it' if status != '0' else 'none broke it', f'{day}, {commit}']
    lines += ['## Fuzzing', '',
              "libFuzzer with the address and undefined-behaviour sanitizers (`scripts/fuzz`). What broke a target lies in `tests/fuzz/crashes` and is replayed by `scripts/test`.", '',
              '| target | inputs | minutes | in the last run | last run |', '|---|---|---|---|---|']
    for name, (runs, minutes, said, when) in sorted(executions.items()):
        kept = len(list((root / 'tests/fuzz/crashes' / name).glob('*')))
        lines.append(f'| `{name}` | {runs:,} | {minutes} | {said}{f"; {kept} kept as tests" if kept else ""} | {when} |')
    lines += [f'| all | {sum(entry[0] for entry in executions.values()):,} | | | |', '']

if (counts / 'properties').exists():
    tries, when = (counts / 'properties').read_text().strip().split(maxsplit=1)
    lines += ['## Properties', '',
              f'What has to come out the same two ways on random meshes (`tests/properties`: threads, order, turned, file and memory, coded and plain, scan, rays and winding, pieces and whole, bodies): {int(tries):,} tries of each with `scripts/properties`, none failed. Last run: {when}.', '']

if (counts / 'torture.json').exists():
    told = json.loads((counts / 'torture.json').read_text())
    when = (counts / 'torture.when').read_text().strip()
    lines += ['## Torture of outputs', '',
              'Twelve kinds of output under kills, failing calls (write, fsync, rename, open, malloc), full disks, file-size and memory limits, and two writers at once (`scripts/torture`). Afterwards the old file has to be there whole or the new one byte for byte, with nothing beside it.', '',
              '| | |', '|---|---|',
              f'| kills that struck before the end | {told["kills_struck"]} of {told["kills"]} |',
              f'| failing calls that struck | {told["failures_struck"]} of {told["failures"]} |',
              f'| limits, full disks, rival writers | {told["limits"]} |',
              f'| wrong | {told["wrong"]} |',
              f'| last run | {when} |', '']
    lines += [f'- {sentence}' for sentence in told.get('sentences', [])]

if (counts / 'bounds.json').exists():
    told = json.loads((counts / 'bounds.json').read_text())
    when = (counts / 'bounds.when').read_text().strip()
    lines += ['## Bounds', '',
              f'Every command over {told["rungs"]} meshes from {told["first"]:,} vertices on, each twice the one before (`scripts/bounds`): processor seconds and memory of the largest, and the most that either grew at a step. 2.5 is the limit, and what is beyond it is in bold; steps below 0.3 s and 60 MiB are not judged (0).', '',
              '| command | seconds | growth | MiB | growth |', '|---|---|---|---|---|']
    def marked(growth):
        return f'**{growth:.2f}**' if growth > 2.5 else f'{growth:.2f}'
    for name, row in told['commands'].items():
        lines.append(f'| {name} | {row["seconds"][-1]:.2f} | {marked(row["seconds_growth"])} | {row["mib"][-1]:.0f} | {marked(row["mib_growth"])} |')
    lines += ['', f'Last run: {when}.', '']

if (counts / 'mutants.json').exists():
    told = json.loads((counts / 'mutants.json').read_text())
    when = (counts / 'mutants.when').read_text().strip() if (counts / 'mutants.when').exists() else ''
    lines += ['## Tests of the tests', '',
              f'Small changes of hierarchy, sample, coding and fracture, one at a time (`scripts/mutate --count {told["made"]} --seed {told["seed"]}`): {told["caught"]} of {told["made"]} made a test fail. Last run: {when}.', '']
    if told['escaped']:
        lines += ['What escaped:', ''] + [f'- `{m["where"]}`: `{m["became"]}`' for m in told['escaped']] + ['']

lines += ['## What nothing covers', '',
          '- The studio is played by scripts, not by hours of random actions.',
          '- No line coverage, no soak of a day.', '']
page.write_text('\n'.join(lines))
