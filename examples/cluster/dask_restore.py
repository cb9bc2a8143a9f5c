#!/usr/bin/env python3
"""Restores a shot on the workers of a Dask cluster, a chunk of its frames a task.

A worker that is lost has its chunk run again by another one; a chunk that ran twice wrote the same bytes.

Usage: dask_restore.py SCHEDULER MODEL.fil POSES SHOT.pc2 CHUNKS
SCHEDULER: tcp://host:8786, as `dask-scheduler` prints it. The paths are those that the workers see.
"""
import os
import subprocess
import sys

import distributed


def restore_chunk(program, model, poses, shot, chunk, chunks):
    """One chunk; what the program says against it is the error."""
    line = [program, "restore", model, "--poses", poses, "-o", shot, "--quiet", "--threads", "1"]
    ran = subprocess.run(line + ["--chunk", f"{chunk}/{chunks}"], capture_output=True, text=True)
    if ran.returncode:
        raise RuntimeError(ran.stderr.strip())


def main():
    scheduler, model, poses, shot, chunks = sys.argv[1:]
    program = os.environ.get("FILIGREE", "filigree")
    # As often as chunks may die with their workers before Dask calls it their fault.
    with distributed.Client(scheduler) as client:
        tasks = [
            client.submit(restore_chunk, program, model, poses, shot, k + 1, int(chunks), pure=False, retries=3)
            for k in range(int(chunks))
        ]
        client.gather(tasks)
    if not os.path.exists(shot):
        sys.exit(f"{shot}: is not whole, though every chunk was written")


if __name__ == "__main__":
    main()
