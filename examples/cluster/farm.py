#!/usr/bin/env python3
"""How long a shot takes on a farm: simulates its tasks, with machines that share one storage.

A task reads, computes, and writes. What machines move at one time shares the storage's rate evenly, each at most its
own network's. Some tasks are killed half way and run again. Each task reads the model once (22
bytes a vertex), restores its frames and writes them (12 bytes a vertex and frame).

    farm.py --vertices 1e9 --frames 1000 --machines 1,10,100 --storage 10
"""
import argparse
import heapq
import random

READ_BYTES, WRITE_BYTES = 22, 12  # a vertex: of the model; of a frame


class Storage:
    """Transfers that share one rate evenly. Work is counted in bytes that each transfer has had since the start."""

    def __init__(self, rate, network):
        self.rate, self.network = rate, network
        self.now = self.each = 0.0
        self.ends = []  # (bytes at which it ends, task)

    def pace(self):
        return min(self.network, self.rate / len(self.ends)) if self.ends else 0.0

    def go_to(self, time):
        self.each += self.pace() * (time - self.now)
        self.now = time

    def add(self, task, size):
        heapq.heappush(self.ends, (self.each + size, task))

    def next_end(self):
        return self.now + max(0.0, self.ends[0][0] - self.each) / self.pace() if self.ends else float("inf")


def shot_tasks(machines, arguments):
    """Of each task: bytes read, seconds, bytes written."""
    tasks = min(arguments.tasks or machines, arguments.frames)
    frames = arguments.frames / tasks
    seconds = frames * arguments.vertices / (arguments.rate * 1e9)
    return [(READ_BYTES * arguments.vertices, seconds, WRITE_BYTES * arguments.vertices * frames)] * tasks


def simulate(machines, tasks, arguments):
    """Seconds until all is written, and the share of the machines that have a task."""
    chance = random.Random(1)
    gigabyte = 1e9
    storage = Storage(arguments.storage * gigabyte, arguments.network * gigabyte)
    waiting = list(range(len(tasks)))
    timers = []  # (time, task, what is over)
    idle, busy, done = machines, 0.0, 0
    step = {}  # of each running task: when it started, whether it fails

    def begin():
        nonlocal idle
        while waiting and idle:
            idle -= 1
            task = waiting.pop()
            step[task] = (storage.now, chance.random() < arguments.lost)
            heapq.heappush(timers, (storage.now + arguments.start, task, "start"))

    begin()
    while done < len(tasks):
        time = min(timers[0][0] if timers else float("inf"), storage.next_end())
        storage.go_to(time)
        if timers and timers[0][0] <= time:
            _, task, what = heapq.heappop(timers)
            if what == "start":
                storage.add((task, "read"), tasks[task][0])
                continue
            started, fails = step.pop(task)
            if not fails:
                step[task] = (started, fails)
                storage.add((task, "written"), tasks[task][2])
                continue
            waiting.append(task)  # killed
        else:
            _, (task, what) = heapq.heappop(storage.ends)
            if what == "read":
                heapq.heappush(timers, (time + tasks[task][1], task, "computed"))
                continue
            started, _ = step.pop(task)
            done += 1
        busy += time - started
        idle += 1
        begin()
    return storage.now, busy / (storage.now * machines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=float, default=1e9)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--machines", default="1,10,40,100")
    parser.add_argument("--tasks", type=int, help="chunks (unset: one a machine)")
    parser.add_argument("--storage", type=float, default=10, help="GB/s of the storage that all share")
    parser.add_argument("--network", type=float, default=1.2, help="GB/s of a machine")
    parser.add_argument("--rate", type=float, default=0.6, help="thousand million vertices a second that one restores")
    parser.add_argument("--start", type=float, default=1, help="seconds until a scheduler has started a task")
    parser.add_argument("--lost", type=float, default=0.01, help="share of the tasks that are killed")
    arguments = parser.parse_args()
    totals = []
    for machines in map(int, arguments.machines.split(",")):
        tasks = shot_tasks(machines, arguments)
        moved = sum(read + written for read, _, written in tasks)
        written = sum(written for _, _, written in tasks)
        totals.append((machines, len(tasks), moved, written, *simulate(machines, tasks, arguments)))
    print(f"{arguments.vertices:.3g} vertices, {arguments.frames} frames: {totals[0][3] / 1e12:.3g} TB; storage {arguments.storage:g} GB/s")
    print("machines  tasks     hours  machines with task  storage at work")
    for machines, tasks, moved, _, seconds, at_work in totals:
        print(f"{machines:8} {tasks:6} {seconds / 3600:9.3f} {at_work:19.0%} "
              f"{moved / seconds / (arguments.storage * 1e9):16.0%}")


if __name__ == "__main__":
    main()
