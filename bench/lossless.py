#!/usr/bin/env python3
"""What `pack --profile lossless` makes of models, beside zstd -12 on the plain files, and whether they come back.

Usage: bench/lossless.py PROGRAM MESH... (clips of 60 frames come from a bend; zstd is Debian's package zstd)
"""

import pathlib
import subprocess
import sys
import tempfile
import time


def run(*words):
    start = time.perf_counter()
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"bench/lossless.py: {' '.join(map(str, words))}: {done.stderr.strip()}")
    return time.perf_counter() - start


def row(program, folder, plain, what):
    coded, back, packed = folder / "coded.fil", folder / "back.fil", folder / "plain.zst"
    seconds = run(program, "pack", plain, "-o", coded, "--profile", "lossless")
    run(program, "unpack", coded, "-o", back)
    run("zstd", "-q", "-12", "-f", plain, "-o", packed)
    same = "same bytes" if plain.read_bytes() == back.read_bytes() else "OTHER BYTES"
    sizes = [path.stat().st_size for path in (plain, packed, coded)]
    print(f"{what:24} {sizes[0]:>12,} {sizes[1]:>12,} {sizes[2]:>12,} {sizes[1] / sizes[2]:>8.2f} {seconds:>8.1f} s  {same}")
    return same == "same bytes"


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    program, meshes = pathlib.Path(sys.argv[1]), [pathlib.Path(word) for word in sys.argv[2:]]
    print(f"{'':24} {'plain':>12} {'zstd -12':>12} {'lossless':>12} {'smaller':>8}")
    good = True
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for mesh in meshes:
            plain, clip = folder / "plain.fil", folder / "clip.fil"
            run(program, "strip", mesh, "-o", plain)
            good &= row(program, folder, plain, mesh.stem)
            run(program, "deform", plain, "-o", clip, "--bend", "90", "--frames", "60")
            good &= row(program, folder, clip, mesh.stem + ", 60 frames")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
