"""Leaks, and what is allocated. In a process of its own: work that Ctrl-C left to itself goes on for a while."""

import gc
import pickle
import resource

import numpy

import filigree


def test_nothing_leaks(tmp_path):
    """Each call again and again after it was warm: memory stays."""
    mesh = filigree.make("wavy-cube", resolution=4)
    box = filigree.make("bar", resolution=1, length=1)
    model = filigree.strip(mesh)
    restorer = filigree.Restorer(model)
    rest = model.driver.vertices
    bend = filigree.bend(mesh, "x", 30)
    body = filigree.Body(mesh, "jelly", particles=30)
    simulation = filigree.Simulation([body], mode="explicit")
    driver = simulation.attach(0, model)
    solver = filigree.HandleSolver(mesh, [0, 1])
    inside = filigree.InsideTest(mesh)
    points = mesh.vertices[:5] * 0.5
    file, model_file = str(tmp_path / "mesh.ply"), str(tmp_path / "model.fil")

    def refused():
        try:
            restorer.positions(rest[:-1])
        except filigree.MismatchError:
            pass

    calls = [
        lambda: filigree.Mesh(numpy.array(mesh.vertices), numpy.array(mesh.faces)).triangles,
        lambda: filigree.strip(mesh, progress=lambda phase, fraction: None),
        lambda: filigree.Restorer(model).positions(rest),
        lambda: restorer.mesh(rest).normals,
        lambda: restorer.gradients(rest),
        lambda: filigree.PoseSequence([rest] * 3)[1].positions,
        lambda: bend(model).gradients,
        lambda: bend(mesh),
        lambda: solver.solve(mesh.vertices[:2], iterations=2),
        lambda: inside.contains(points),
        lambda: filigree.sample(mesh, spacing=0.2),
        lambda: filigree.info(mesh),
        lambda: filigree.compare(mesh, mesh, samples=10),
        lambda: (simulation.step(), driver.pose(), simulation.positions(0)),
        lambda: simulation.restore(simulation.save()),
        lambda: filigree.Body(box, "jelly", particles=8),
        lambda: pickle.loads(pickle.dumps((model, mesh, restorer))),
        lambda: (filigree.write_mesh(mesh, file), filigree.read_mesh(file)),
        lambda: (filigree.write_model(model, model_file), filigree.read_model(model_file)),
        lambda: filigree.fracture(box, 2, roughness=0).mesh,
        refused,
    ]

    def kilobytes():
        gc.collect()
        return int(open("/proc/self/statm").read().split()[1]) * resource.getpagesize() // 1024

    for call in calls:
        for _ in range(100):
            call()
        for _ in range(12):  # an allocator's habits end, a leak does not
            before = kilobytes()
            for _ in range(400):
                call()
            grown = kilobytes() - before
            if grown < 400:
                break
        assert grown < 400, calls.index(call)


def test_restoring_into_an_array_allocates_nothing_of_its_size(model, pose):
    big = filigree.strip(filigree.make("wavy-cube", resolution=200), base=1000)
    restorer = filigree.Restorer(big)
    out = numpy.empty((len(restorer), 3), "f4")
    restorer.positions(big.driver.vertices, out=out)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(50):
        restorer.positions(big.driver.vertices, out=out)
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 < out.nbytes / 4
