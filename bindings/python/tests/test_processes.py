"""Ctrl-C, callbacks, threads, processes, pickles."""

import copy
import multiprocessing
import os
import pickle
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy
import pytest

import filigree
from conftest import same, same_mesh


def body_at_work():
    body = filigree.Body(filigree.make("bar", resolution=16), "jelly", particles=30000)
    simulation = filigree.Simulation([body], obstacles=[filigree.Obstacle.plane((0, -0.6, 0))])
    return lambda: simulation.step(100000)


def ask_about(mesh, points):
    return lambda: filigree.contains(mesh, points, method="winding")


LONG = {
    "strip": lambda mesh: lambda: filigree.strip(mesh),
    "strip to fidelity": lambda mesh: lambda: filigree.strip(mesh, fidelity=1e-6),
    "remesh": lambda mesh: lambda: filigree.remesh(mesh, 200_000),
    "sample": lambda mesh: lambda: filigree.sample(mesh, count=20_000_000, pattern="poisson"),
    "contains": lambda mesh: ask_about(mesh, numpy.random.rand(5_000_000, 3) - 0.5),
    "compare": lambda mesh: lambda: filigree.compare(mesh, mesh, samples=20_000_000),
    "simulate": lambda mesh: body_at_work(),
}


@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_is_heard(name, big_mesh):
    work = LONG[name](big_mesh)
    pressed = []

    def press():
        pressed.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.25, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        work()
    seconds = time.perf_counter() - pressed[0]
    timer.join()
    print(f"{name}: {1000 * seconds:.0f} ms")
    assert seconds < (0.2 if os.getloadavg()[0] < 1 else 1)  # tests run beside others


def test_progress_tells_and_cancels(mesh):
    told = []
    filigree.strip(mesh, progress=lambda phase, fraction: told.append((phase, fraction)))
    assert told and all(isinstance(phase, str) and 0 <= fraction <= 1 for phase, fraction in told)
    big = filigree.make("wavy-cube", resolution=200)
    with pytest.raises(filigree.Cancelled, match="Cancelled") as cancelled:
        filigree.remesh(big, 100_000, progress=lambda phase, fraction: False)
    assert cancelled.value.code == 130
    with pytest.raises(ZeroDivisionError):
        filigree.remesh(big, 100_000, progress=lambda phase, fraction: 1 / 0)
    with pytest.raises(filigree.UsageError):
        filigree.strip(mesh, progress=5)


def test_other_threads_run_meanwhile(big_mesh):
    ticks, done = [], threading.Event()

    def tick():
        while not done.wait(0.002):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.perf_counter()
    filigree.strip(big_mesh, base=1000)
    end = time.perf_counter()
    done.set()
    thread.join()
    assert sum(start < t < end for t in ticks) > 5


def test_four_threads_share_one_restorer(model, pose):
    restorer = filigree.Restorer(model)
    wanted = restorer.positions(pose)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: restorer.positions(pose), range(200)):
            assert same(found, wanted)
        for found in pool.map(lambda _: filigree.strip(model.mesh, base=200).tobytes(), range(8)):
            assert found == model.tobytes()


def work_of_child(model, pose):
    return filigree.Restorer(model).positions(pose), filigree.strip(model.mesh, base=200).tobytes()


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes_give_the_same_bytes(method, model, pose):
    wanted = work_of_child(model, pose)  # the parent's threads are there before it forks
    with multiprocessing.get_context(method).Pool(2) as pool:
        results = [pool.apply_async(work_of_child, (model, pose)) for _ in range(4)]
        for result in results:
            positions, stripped = result.get(timeout=60)
            assert same(positions, wanted[0]) and stripped == wanted[1]


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


def test_pickles(mesh, model, pose, tmp_path):
    assert pickled(model).tobytes() == model.tobytes()
    assert filigree.Model.frombytes(model.tobytes()).tobytes() == model.tobytes()
    assert same_mesh(pickled(mesh), mesh)
    for copied in (pickled(pose), copy.deepcopy(pose)):
        assert same(copied.positions, pose.positions) and same(copied.gradients, pose.gradients)
    restorer = filigree.Restorer(model, level=0)
    again = pickled(restorer)
    assert (again.level, len(again)) == (0, len(restorer))
    assert same(again.positions(pose), restorer.positions(pose))
    poses = filigree.PoseSequence([pose, pose], 30)
    assert pickled(poses).frames_per_second == 30 and same(pickled(poses)[1].gradients, pose.gradients)
    jelly = filigree.Material("jelly", density=1234)
    assert pickled(jelly) == jelly and jelly != filigree.Material("jelly")


def test_pickled_meshes_keep_everything(tmp_path):
    mesh = filigree.Mesh(
        numpy.eye(4, 3) + 1e7,
        [[0, 1, 2], [0, 2, 3]],
        normals=numpy.eye(3),
        normal_corners=[0, 1, 2, 0, 1, 2],
        uvs=numpy.zeros((4, 2)),
        colors=numpy.full((4, 4), 0.5),
        scalars={"heat": range(4)},
    )
    again = pickled(mesh)
    assert same_mesh(mesh, again) and again.origin[0] != 0
    for name in ("normals", "normal_corners", "uvs", "colors"):
        assert same(getattr(mesh, name), getattr(again, name))
    assert same(mesh.scalars["heat"], again.scalars["heat"]) and again.uv_corners is None
    broken = filigree.fracture(filigree.make("bar", resolution=4), 3).mesh
    assert pickled(broken).objects[0] == broken.objects[0] and same(pickled(broken).objects[1], broken.objects[1])
    with pytest.raises(filigree.BadFileError):
        filigree.Mesh.__new__(filigree.Mesh).__setstate__((2,))
    with pytest.raises(filigree.BadFileError):
        filigree.Model.frombytes(b"no model")
