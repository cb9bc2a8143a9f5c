#!/usr/bin/env python3
"""Restores a shot, draws a film's pictures or makes a sweep on the workers of a Dask cluster, a chunk a task.

A worker that is lost has its chunk run again by another one; a chunk that ran twice wrote the same bytes.

Usage: dask_chunks.py SCHEDULER CHUNKS restore MODEL.fil --poses POSES -o SHOT.pc2
       dask_chunks.py SCHEDULER CHUNKS render MODEL.fil --poses POSES... -o frame_%04d.png
       dask_chunks.py SCHEDULER CHUNKS sweep SCENE.toml --set body.young_modulus=1e4,1e5 -o TABLE.csv
SCHEDULER: tcp://host:8786, as `dask-scheduler` prints it. The paths are those that the workers see.
"""
import os
import subprocess
import sys

import distributed


def make_chunk(program, words, chunk, chunks):
    """One chunk; what the program says against it is the error."""
    line = [program, *words, "--quiet", "--threads", "1", "--chunk", f"{chunk}/{chunks}"]
    ran = subprocess.run(line, capture_output=True, text=True)
    if ran.returncode:
        raise RuntimeError(ran.stderr.strip())


def main():
    scheduler, chunks, *words = sys.argv[1:]
    program = os.environ.get("FILIGREE", "filigree")
    # As often as chunks may die with their workers before Dask calls it their fault.
    with distributed.Client(scheduler) as client:
        tasks = [
            client.submit(make_chunk, program, words, k + 1, int(chunks), pure=False, retries=3)
            for k in range(int(chunks))
        ]
        client.gather(tasks)
    output = words[words.index("-o") + 1]
    if os.path.exists(output + ".chunks"):
        sys.exit(f"{output}: is not whole, though every chunk was made")


if __name__ == "__main__":
    main()
