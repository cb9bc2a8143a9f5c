#!/usr/bin/python3
"""Breaks outputs in every way that machines do, and looks at what is left.

Usage: torture.py PROGRAM [--kills N] [--failures N] [--json FILE] [--only NAME]

Of each kind of output: a kill before every call that changes a file or a folder; N kills at moments spread over the
whole run, half of them by the clock, half where it asks for memory; the n-th write, fsync, rename, open and malloc
failing, full disks, file-size limits, little memory, folders that may not be written, links that lead nowhere, closed
pipes, two writers at once. After each the old file has to be there whole, or the new one, byte for byte; no temporary
file may stay after a failure, nor after the run that follows a kill; the exit code is one of the documented ones, and
standard error has one sentence.
"""
import argparse, json, os, random, resource, shutil, signal, subprocess, sys, tempfile, time
from pathlib import Path

kCodes = {0, 2, 3, 4, 5, 6, 7, 8, 9, 130}
kOld = b'old bytes, to be kept\n'


class Output:
    def __init__(self, name, words, target):
        self.name, self.words, self.target = name, words, target
        self.is_folder = target.endswith('/') or '####' in target

    def command(self, program, folder):
        return [program, *self.words, '-o', str(folder / self.target) + ('/' if self.target.endswith('/') else ''), '--threads', '1']


def outputs():
    return [
        Output('mesh.ply', ['deform', 'cube.ply', '--bend', '40'], 'out.ply'),
        Output('mesh.obj', ['deform', 'cube.ply', '--bend', '40'], 'out.obj'),
        Output('model', ['strip', 'cube.ply', '--base', '200'], 'out.fil'),
        Output('coded', ['pack', 'cube.fil', '--profile', 'stream'], 'out.fil'),
        Output('glb', ['export', 'moving.fil'], 'out.glb'),
        Output('compressed', ['export', 'moving.fil', '--compress'], 'out.glb'),
        Output('pc2', ['export', 'moving.fil'], 'out.pc2'),
        Output('usda', ['export', 'moving.fil'], 'out.usda'),
        Output('points', ['sample', 'cube.ply', '--count', '3000'], 'points.ply'),
        Output('pieces', ['fracture', 'cube.ply', '--pieces', '6'], 'out.glb'),
        Output('frames', ['export', 'moving.fil'], 'frame_####.ply'),
        Output('page', ['export', 'moving.fil', '--web', '--stream'], 'page/'),
    ]


class Torture:
    def __init__(self, program, options):
        self.program, self.options = program, options
        self.home = Path(tempfile.mkdtemp(prefix='filigree-torture-'))
        self.counts = {'kills': 0, 'kills_struck': 0, 'failures': 0, 'failures_struck': 0, 'limits': 0}
        self.wrong = []
        self.shim = self.home / 'failing_calls.so'
        here = Path(__file__).parent
        subprocess.run(['cc', '-shared', '-fPIC', '-O1', '-o', self.shim, here / 'failing_calls.c', '-ldl'], check=True)
        make = lambda *words: subprocess.run([program, *words, '--quiet'], cwd=self.home, check=True)
        make('make', 'wavy-cube', '-o', 'cube.ply', '--resolution', '30')
        make('strip', 'cube.ply', '-o', 'cube.fil', '--base', '200')
        make('deform', 'cube.fil', '-o', 'moving.fil', '--bend', '50', '--frames', '8')

    def say(self, output, how, what):
        self.wrong.append(f'{output.name}, {how}: {what}')
        print(f'  WRONG {self.wrong[-1]}', flush=True)

    # ---- what is there before and after

    def prepare(self, output):
        folder = self.home / 'work'
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        if output.target.endswith('/'):
            (folder / output.target).mkdir()
        for name in self.reference[output.name]:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(kOld)
        return folder

    def state(self, folder):
        return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob('*')) if path.is_file()}

    def make_reference(self, output):
        folder = self.home / 'reference'
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        start = time.monotonic()
        done = subprocess.run(output.command(self.program, folder), cwd=self.home, capture_output=True)
        if done.returncode != 0:
            sys.exit(f'torture: {output.name}: {done.stderr.decode()}')
        self.seconds = time.monotonic() - start
        self.reference[output.name] = self.state(folder)

    def judge(self, output, folder, how, code, errors, was_killed=False):
        reference, state = self.reference[output.name], self.state(folder)
        hidden = [name for name in state if Path(name).name.startswith('.') or '/.' in '/' + name]
        whole = {name: bytes for name, bytes in state.items() if name not in hidden}
        is_old = all(whole.get(name) == kOld for name in reference)
        is_new = all(whole.get(name) == bytes for name, bytes in reference.items())
        # A sequence whose files were being put in their places says so, is not read, and is finished by the next run.
        is_being_placed = was_killed and any('-placing' in name for name in hidden)
        if not is_old and not is_new and not is_being_placed:
            mixed = [name for name in reference if whole.get(name) not in (kOld, reference[name])]
            self.say(output, how, f'neither the old nor the new: {mixed[:3] or "a mixture of both"}')
        if set(whole) - set(reference):
            self.say(output, how, f'more files than there should be: {sorted(set(whole) - set(reference))[:3]}')
        if was_killed:
            return
        if hidden:
            self.say(output, how, f'left behind: {hidden[:3]}')
        if code not in kCodes:
            self.say(output, how, f'exit code {code}: {errors.decode(errors="replace")[-200:]}')
        elif code == 0 and not is_new:
            self.say(output, how, 'exit code 0, and it is not the new file')
        elif code != 0 and not errors.strip():
            self.say(output, how, f'exit code {code} without a sentence')

    def run(self, output, folder, **how):
        done = subprocess.run(output.command(self.program, folder), cwd=self.home, capture_output=True, timeout=120, **how)
        return done.returncode if done.returncode >= 0 else 128 - done.returncode, done.stderr

    # ---- the ways

    def kill_by_clock(self, output, moment):
        folder = self.prepare(output)
        process = subprocess.Popen(output.command(self.program, folder), cwd=self.home, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        time.sleep(moment)
        struck = process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.communicate()
        self.judge_killed(output, folder, f'killed after {moment:.4f} s', struck)

    def kill_at_call(self, output, call, number):
        folder = self.prepare(output)
        environment, log = self.shimmed(call, number, FAILING_HOW='kill')
        self.run(output, folder, env=environment)
        self.judge_killed(output, folder, f'killed before call {number} of {call}', log.exists())
        return log.exists()

    def judge_killed(self, output, folder, how, struck):
        self.counts['kills'] += 1
        self.counts['kills_struck'] += struck
        self.judge(output, folder, how, None, b'', was_killed=True)
        if struck: # and the next run puts it right
            code, errors = self.run(output, folder)
            self.judge(output, folder, f'the run after it was {how}', code, errors)
            if code != 0:
                self.say(output, f'the run after it was {how}', f'exit code {code}')

    def shimmed(self, call, number, **more):
        """The environment in which the n-th call is struck, and the file that tells that it was."""
        log = self.home / 'failed'
        log.unlink(missing_ok=True)
        names = dict(LD_PRELOAD=str(self.shim), FAILING_CALL=call, FAILING_NUMBER=str(number), FAILING_LOG=str(log))
        return {**os.environ, **names, **more}, log

    def count_calls(self, output, call):
        environment, log = self.shimmed(call, 0)
        self.run(output, self.prepare(output), env=environment)
        return int(log.read_text())

    def fail_call(self, output, call, number):
        folder = self.prepare(output)
        environment, log = self.shimmed(call, number)
        code, errors = self.run(output, folder, env=environment)
        self.counts['failures'] += 1
        self.counts['failures_struck'] += log.exists()
        self.judge(output, folder, f'{call} number {number} fails', code, errors)
        return log.exists()

    def limit(self, output, how, limits=None, arrange=None):
        folder = self.prepare(output)
        undo = arrange(folder) if arrange else None
        code, errors = self.run(output, folder, preexec_fn=limits)
        if undo: undo()
        self.counts['limits'] += 1
        self.judge(output, folder, how, code, errors)

    def two_writers(self, output):
        folder = self.prepare(output)
        both = [subprocess.Popen(output.command(self.program, folder), cwd=self.home, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) for _ in range(2)]
        ends = [(process.communicate()[1], process.returncode) for process in both]
        self.counts['limits'] += 1
        self.judge(output, folder, 'two writers', max(code for _, code in ends), b''.join(errors for errors, _ in ends))

    def full_disk(self, output, size):
        """A small disk of its own, where the system lets us mount one."""
        disk = self.home / 'disk'
        disk.mkdir(exist_ok=True)
        if subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={size}', 'tmpfs', disk], capture_output=True).returncode != 0:
            return False
        try:
            code, errors = self.run(output, disk)
            left = [str(path) for path in disk.rglob('*') if path.is_file()]
            if code == 0 and self.state(disk) != self.reference[output.name]:
                self.say(output, f'a disk of {size} bytes', 'exit code 0, and it is not the new file')
            if code != 0 and left:
                self.say(output, f'a disk of {size} bytes', f'left behind: {left[:3]}')
            if code not in kCodes:
                self.say(output, f'a disk of {size} bytes', f'exit code {code}')
        finally:
            subprocess.run(['umount', disk])
        self.counts['limits'] += 1
        return True

    def write_report(self, output, counts, wrong):
        """After every output, into the report that is there: a run that is stopped, or of one output, keeps the others."""
        if not self.options.json:
            return
        file = Path(self.options.json)
        report = json.loads(file.read_text()) if file.exists() else {}
        report[output.name] = {**counts, 'sentences': wrong}
        file.write_text(json.dumps(report, indent=1))

    def all(self):
        self.reference = {}
        random.seed(1)
        for output in outputs():
            if self.options.only and output.name != self.options.only:
                continue
            self.make_reference(output)
            size = sum(len(bytes) for bytes in self.reference[output.name].values())
            before, wrong_before = dict(self.counts), len(self.wrong)
            number = 1
            while self.kill_at_call(output, 'any', number):
                number += 1
            half = self.options.kills // 2
            asked = self.count_calls(output, 'malloc')
            for k in range(half):
                self.kill_by_clock(output, self.seconds * (0.3 + 0.75 * (k + random.random()) / half))
                self.kill_at_call(output, 'malloc', 1 + int(asked * (k + random.random()) / half))
            for call in ('write', 'fsync', 'rename', 'open', 'malloc'):
                for k in range(self.options.failures):
                    number = k + 1 if k < self.options.failures // 2 else random.randint(1, 400)
                    if not self.fail_call(output, call, number) and k < self.options.failures // 2:
                        break
            for share in (0, 0.3, 0.7, 0.97):
                bytes_ = max(int(share * size / max(1, len(self.reference[output.name]))), 1)
                self.limit(output, f'files of at most {bytes_} bytes', lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_, bytes_)))
                self.full_disk(output, max(4096, int(share * size) // 4096 * 4096))
            for memory in (150, 200, 300): # less does not load the program
                self.limit(output, f'{memory} MB of memory', lambda: resource.setrlimit(resource.RLIMIT_AS, (memory << 20, memory << 20)))
            self.two_writers(output)
            counts = {name: count - before[name] for name, count in self.counts.items()}
            print(f'{output.name}: {counts["kills_struck"]} kills and {counts["failures_struck"]} failures struck', flush=True)
            self.write_report(output, counts, self.wrong[wrong_before:])
        shutil.rmtree(self.home, ignore_errors=True)
        print(json.dumps({**self.counts, 'wrong': len(self.wrong)}))
        return 1 if self.wrong else 0


if __name__ == '__main__':
    parser = argparse.ArgumentParser()
    parser.add_argument('program')
    parser.add_argument('--kills', type=int, default=20)
    parser.add_argument('--failures', type=int, default=6)
    parser.add_argument('--json')
    parser.add_argument('--only')
    options = parser.parse_args()
    sys.exit(Torture(str(Path(options.program).resolve()), options).all())
