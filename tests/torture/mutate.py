#!/usr/bin/env python3
"""Tests of the tests: makes one small change of the library at a time, and sees whether a test fails.

Usage: mutate.py RELEASE SINGLE WORK [--count N] [--seed S] [--add | --again] [--jobs N] [--json FILE]
RELEASE is a build whose tests pass; SINGLE is configured to compile one source at a time; WORK is for files of its own.
The tree is left as it is: a changed copy of one source is compiled and linked into a library beside the release's, which
its tests then load. Changes are of arithmetic, comparisons, logic and constants in the layers below. One that does not
compile is passed over. --add counts on from what FILE holds, of other seeds; --again tries those that escaped there, as
tests may catch them by now.
"""
import argparse
import concurrent.futures
import itertools
import json
import os
import pathlib
import random
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAYERS = {  # and the tests that judge them, quick ones first
    "blend": ["properties_test", "same_bytes", "blend_test"],
    "levels": ["properties_test", "same_bytes", "levels_test"],
    "sample": ["properties_test", "same_bytes", "sample_test"],
    "pack": ["properties_test", "same_bytes", "pack_test"],
    "fracture": ["same_bytes", "fracture_test"],
}
CHANGES = [
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " + "), (r" / ", " * "), (r" < ", " <= "), (r" <= ", " < "),
    (r" > ", " >= "), (r" >= ", " > "), (r" == ", " != "), (r" != ", " == "), (r" && ", " || "), (r" \|\| ", " && "),
    (r"std::min\(", "std::max("), (r"std::max\(", "std::min("), (r"\+\+", "--"), (r"\b1\b", "2"), (r"\b0\b", "1"),
]
NO_CODE = re.compile(r"^\s*(//|#|\*|using|template|namespace|static_assert|struct|class|enum)|Error\{|\"|report\(|reserve\(")
MOST_MEMORY = 8 << 30  # a change may ask for all there is


def sites():
    found = {layer: [] for layer in LAYERS}
    for layer in LAYERS:
        for path in sorted((ROOT / "src/filigree" / layer).glob("*.cpp")):
            for number, line in enumerate(path.read_text().splitlines()):
                code = line.split("//")[0]
                if NO_CODE.search(code):
                    continue
                for pattern, text in CHANGES:
                    if "template" in code or (" < " in pattern and "<" in code.replace(" < ", "")):
                        continue
                    found[layer] += [(path, number, m.start(), m.end(), text) for m in re.finditer(pattern, code)]
    return found


def command_of(test, release):
    if test == "same_bytes":
        return [ROOT / "tests/apps/same_bytes", release / "bin/filigree"]
    return [release / "bin" / test, "--gtest_fail_fast", "--gtest_brief=1"]


def run(words, **how):
    return subprocess.run([str(word) for word in words], capture_output=True, **how)


def random_changes(by_layer, choice):
    """Of one layer after another, without end: layer, path, line number and what that line becomes."""
    for layer in itertools.cycle(LAYERS):
        path, number, begin, end, text = choice.choice(by_layer[layer])
        was = path.read_text().splitlines(keepends=True)[number]
        yield layer, path, number, was[:begin] + text + was[end:]


def escaped_changes(told):
    """The same, of those that escaped."""
    changes = []
    for mutant in told["escaped"]:
        file, was_at = mutant["where"].rsplit(":", 1)
        path = ROOT / file
        lines = path.read_text().splitlines(keepends=True)
        same = [n for n, line in enumerate(lines) if line.strip() == mutant["was"]]
        number = min(same, key=lambda n: abs(n + 1 - int(was_at)), default=None)  # a line may stand there twice
        if number is None:
            sys.exit(f"mutate: {mutant['where']} has changed: there is no line \"{mutant['was']}\"; take it out of the file")
        was = lines[number]
        changes.append((path.parent.name, path, number, was.replace(mutant["was"], mutant["became"])))
    return changes


class Library:
    """Links the release's library with one source replaced."""

    def __init__(self, release, single):
        self.release, self.single = release, single
        self.commands = {entry["file"]: entry["command"] for entry in json.loads((single / "compile_commands.json").read_text())}
        objects = [self.object_of(file) for file in self.commands if self.layer_of(file) in LAYERS]
        subprocess.run(["cmake", "--build", str(single), "--target", *objects], check=True, stdout=subprocess.DEVNULL)
        made = run(["ninja", "-C", release, "-t", "commands", "src/filigree/libfiligree.so"], text=True, check=True)
        link = next(line for line in made.stdout.splitlines() if " -shared " in line).split("&&")[1]
        words = shlex.split(link)
        of_layers = re.compile("|".join(f"unity_{layer}_" for layer in LAYERS))
        words = [word for word in words if not of_layers.search(word)]
        self.output = words.index("-o") + 1
        self.link = words
        self.objects = {name: single / name for name in objects}

    def layer_of(self, file):
        return pathlib.Path(file).parent.name if "/src/filigree/" in file else None

    def object_of(self, file):
        return re.search(r"-o (\S+)", self.commands[file])[1]

    def make(self, folder, path, text):
        """False: it does not compile."""
        changed, made = folder / path.name, folder / "changed.o"
        changed.write_text(text)
        command = self.commands[str(path)].replace(f"-c {path}", f"-c {changed} -I{path.parent} -w")
        command = command.replace(f"-o {self.object_of(str(path))}", f"-o {made}")
        if run(shlex.split(command), cwd=self.single).returncode != 0:
            return False
        objects = [made if name == self.object_of(str(path)) else place for name, place in self.objects.items()]
        words = list(self.link)
        name = next(word for word in words if word.startswith("-Wl,-soname,")).rpartition(",")[2]
        words[self.output] = folder / name
        run([*words, *objects], cwd=self.release, check=True)
        return True


def fails(release, test, folder, seconds):
    """None: it passes."""
    where = folder / "run"
    shutil.rmtree(where, ignore_errors=True)
    where.mkdir()
    process = subprocess.Popen([str(word) for word in command_of(test, release)], cwd=where, start_new_session=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               env={**os.environ, "LD_LIBRARY_PATH": str(folder), "TMPDIR": str(where)},
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY)))
    try:
        return test if process.wait(timeout=seconds) != 0 else None
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # what it started, too
        process.wait()
        return f"{test} does not end"


def main():
    parser = argparse.ArgumentParser()
    for name in ("release", "single", "work"):
        parser.add_argument(name, type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--add", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    told = {"seeds": {}, "made": 0, "caught": 0, "escaped": []}
    if (options.add or options.again) and options.json and options.json.exists():
        told = json.loads(options.json.read_text())
    by_layer = sites()
    seed = str(options.seed)
    if options.again:
        changes = escaped_changes(told)
        options.count = len(changes)
        told["made"] -= len(changes)
        told["escaped"] = []
    elif seed in told["seeds"]:
        sys.exit(f"mutate: changes of seed {seed} are counted already; take another seed")
    else:
        changes = random_changes(by_layer, random.Random(options.seed))
        told["seeds"][seed] = 0
    changes = iter(changes)
    library = Library(options.release, options.single)
    lock = threading.Lock()
    tried = 0

    # As many at a time as later, unchanged: how long each test takes, and that it passes like this.
    def unchanged(number, test):
        folder = options.work / f"unchanged-{number}"
        folder.mkdir(parents=True, exist_ok=True)
        path = by_layer["blend"][0][0]
        assert library.make(folder, path, path.read_text())
        begin = time.monotonic()
        if by := fails(options.release, test, folder, 1200):
            sys.exit(f"mutate: nothing is changed and {by} fails")
        return test, time.monotonic() - begin

    tests = sorted({test for of_layer in LAYERS.values() for test in of_layer})
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        seconds = dict(pool.map(unchanged, range(len(tests)), tests))
    print("mutate: unchanged: " + ", ".join(f"{test} {taken:.0f} s" for test, taken in seconds.items()), flush=True)

    def try_changes(worker):
        nonlocal tried
        folder = options.work / f"worker-{worker}"
        folder.mkdir(parents=True, exist_ok=True)
        while True:
            with lock:
                if tried >= options.count:
                    return
                change = next(changes, None)
                if change is None:
                    return  # one of those that escaped does not compile any more
                layer, path, number, line = change
                tried += 1
            lines = path.read_text().splitlines(keepends=True)
            was = lines[number]
            lines[number] = line
            if not library.make(folder, path, "".join(lines)):
                with lock:
                    tried -= 1
                continue
            by = next((by for test in LAYERS[layer] if (by := fails(options.release, test, folder, 20 + 4 * seconds[test]))), None)
            where = f"{path.relative_to(ROOT)}:{number + 1}"
            with lock:
                told["made"] += 1
                if not options.again:
                    told["seeds"][seed] += 1
                told["caught"] += by is not None
                if by is None:
                    told["escaped"].append({"where": where, "was": was.strip(), "became": lines[number].strip()})
                print(f"mutate: {told['made']:3}  {where}: {lines[number].strip()}\n             {by or 'ESCAPED'}", flush=True)
                if options.json:
                    options.json.write_text(json.dumps(told, indent=1))

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(try_changes, range(options.jobs)))
    print(f"mutate: {told['caught']} of {told['made']} were caught")


if __name__ == "__main__":
    sys.exit(main())
