"""The module's results are the program's, to the byte."""

import pickle

import numpy
import pytest

import filigree


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(mesh, path="mesh.ply"):
    filigree.write_mesh(mesh, path)
    return path


def is_same_file(a, b):
    return open(a, "rb").read() == open(b, "rb").read()


def test_make(program):
    program("make", "wavy-cube", "-o", "theirs.ply", "--resolution", 20)
    write(filigree.make("wavy-cube", resolution=20), "ours.ply")
    assert is_same_file("ours.ply", "theirs.ply")


@pytest.mark.parametrize(
    "words, options",
    [
        ([], {}),
        (["--base", 300], {"base": 300}),
        (["--levels", 2], {"levels": 2}),
        (["--error", 1e-3], {"error": 1e-3}),
        (["--fidelity", 1e-3], {"fidelity": 1e-3}),
        (["--max-edge", 0.1], {"max_edge": 0.1}),
    ],
)
def test_strip(program, mesh, words, options):
    program("strip", write(mesh), "-o", "theirs.fil", *words)
    filigree.write_model(filigree.strip(filigree.read_mesh("mesh.ply"), **options), "ours.fil")
    assert is_same_file("ours.fil", "theirs.fil")


@pytest.mark.parametrize("words, options", [([], {}), (["--level", 0], {"level": 0})])
def test_restore(program, model, words, options):
    filigree.write_model(model, "model.fil")
    moved = model.driver.with_vertices(model.driver.vertices * [1, 1.5, 0.8])
    program("restore", "model.fil", "--pose", write(moved, "pose.ply"), "-o", "theirs.ply", *words)
    write(filigree.restore(model, moved.vertices, **options), "ours.ply")
    assert is_same_file("ours.ply", "theirs.ply")


@pytest.mark.parametrize("words, options", [([], {}), (["--references", 6, "--levels", 2], {"references": 6, "levels": 2})])
def test_the_reference_code(program, words, options):
    write(filigree.make("wavy-cube", resolution=16), "cube.ply")
    program("strip", "cube.ply", "-o", "theirs.fil", "--code", "reference", *words)
    model = filigree.strip_reference(filigree.read_mesh("cube.ply"), **options)
    assert model.tobytes() == open("theirs.fil", "rb").read()
    moved = model.driver.with_vertices(model.driver.vertices * [1, 1.5, 0.8])
    program("restore", "theirs.fil", "--pose", write(moved, "pose.ply"), "-o", "theirs.ply", "--law", "keep", "--level", 1)
    write(model.restore(moved.vertices, law="keep", level=1), "ours.ply")
    assert is_same_file("ours.ply", "theirs.ply")
    again = pickle.loads(pickle.dumps(model))
    assert again.tobytes() == model.tobytes() and again.finest_level == model.finest_level
    with pytest.raises(filigree.UnsuitableError, match="reference code"):
        filigree.read_model("theirs.fil")
    with pytest.raises(filigree.UnsuitableError, match="blend code"):
        filigree.ReferenceModel.frombytes(filigree.strip(model.mesh).tobytes())
    with pytest.raises(filigree.UsageError, match="law is 'murphy'"):
        model.restore(moved.vertices, law="murphy")
    with pytest.raises(filigree.MismatchError):
        model.restore(moved.vertices[:-1])


def test_deform(program, mesh, model):
    filigree.write_model(model, "model.fil")
    warps = ["--axis", "y", "--bend", 60, "--twist", 30, "--random", 0.1, "--seed", 3]
    program("deform", "model.fil", "-o", "theirs.ply", *warps)
    program("deform", write(mesh), "-o", "theirs_full.ply", *warps)
    warp = filigree.chain(
        filigree.bend(mesh, "y", 60), filigree.twist(mesh, "y", 30), filigree.smooth_random(mesh, 0.1, 3)
    )
    write(filigree.restore(model, warp(model)), "ours.ply")
    write(warp(mesh), "ours_full.ply")
    assert is_same_file("ours.ply", "theirs.ply")
    assert is_same_file("ours_full.ply", "theirs_full.ply")


def test_handles(program, model):
    filigree.write_model(model, "model.fil")
    open("handles.json", "w").write(
        '{"handles": [{"box": {"min": [-9, -9, 0.3], "max": [9, 9, 9]}, "move": [0, 0.2, 0.1]},'
        ' {"box": {"min": [-9, -9, -9], "max": [9, 9, -0.3]}}]}'
    )
    program("deform", "model.fil", "-o", "theirs.ply", "--handles", "handles.json")
    pose = filigree.move_by_handles(model, filigree.read_handles("handles.json"))
    write(filigree.restore(model, pose), "ours.ply")
    assert is_same_file("ours.ply", "theirs.ply")


@pytest.mark.parametrize("pattern", ["lattice", "jitter", "poisson"])
def test_sample(program, mesh, pattern):
    program("sample", write(mesh), "-o", "theirs.ply", "--count", 2000, "--pattern", pattern, "--seed", 5)
    points = filigree.sample(mesh, count=2000, pattern=pattern, seed=5)
    assert numpy.array_equal(points.astype("f4"), filigree.read_mesh("theirs.ply").vertices)


def test_remesh(program, mesh):
    program("remesh", write(mesh), "-o", "theirs.ply", "--quads", 3000)
    write(filigree.remesh(mesh, 3000)[0], "ours.ply")
    assert is_same_file("ours.ply", "theirs.ply")


def test_fracture(program, mesh):
    program("fracture", write(mesh), "-o", "theirs.ply", "--pieces", 5, "--seed", 2, "--explode", 0.2)
    broken = filigree.fracture(filigree.read_mesh("mesh.ply"), 5, seed=2).exploded(0.2)
    theirs = filigree.read_mesh("theirs.ply")
    assert numpy.array_equal(broken.vertices, theirs.vertices)
    assert numpy.array_equal(broken.corners, theirs.corners)


@pytest.mark.parametrize("name", ["skin.glb", "cache.pc2", "cache.mdd"])
def test_export(program, model, name):
    poses = [filigree.bend(model, "z", angle)(model) for angle in (0, 20, 40)]
    filigree.write_model(model, "model.fil", poses=filigree.PoseSequence(poses, 24))
    program("export", "model.fil", "-o", "theirs_" + name)
    filigree.export(model, "ours_" + name, filigree.read_poses("model.fil"), materials_beside="model.fil")
    assert is_same_file("ours_" + name, "theirs_" + name)


def test_morph(program, model):
    poses = [filigree.bend(model, "z", angle)(model) for angle in (0, 20, 40)]
    filigree.write_model(model, "model.fil", poses=filigree.PoseSequence(poses, 24))
    program("export", "model.fil", "-o", "theirs.glb", "--as", "morph")
    filigree.export(model, "ours.glb", filigree.read_poses("model.fil"), motion="morph", materials_beside="model.fil")
    assert is_same_file("ours.glb", "theirs.glb")


def test_simulate(program):
    write(filigree.make("wavy-cube", resolution=12), "cube.ply")
    open("scene.toml", "w").write(
        """
        [simulation]
        frames = 12
        [[body]]
        mesh = "cube.ply"
        material = "jelly"
        particles = 300
        centre = [0, 0.8, 0]
        [[obstacle]]
        shape = "ground"
        """
    )
    program("simulate", "scene.toml", "-o", "theirs.fil")
    run = filigree.SceneRun("scene.toml")
    run.advance_to(5)
    state = run.save()
    again = filigree.SceneRun("scene.toml", threads=1)
    again.resume(state)
    for other in (run, again):
        other.advance_to(12)
        filigree.write_model(other.model(0), "ours.fil", poses=other.poses(0))
        assert is_same_file("ours.fil", "theirs.fil")


def test_info_and_compare(program, mesh, model):
    import json
    import os
    import subprocess

    write(mesh)
    filigree.write_model(model, "model.fil")
    write(filigree.bend(mesh, "x", 5)(mesh), "bent.ply")

    def said(*words):
        return json.loads(subprocess.check_output([os.environ["FILIGREE_PROGRAM"], *words, "--json"], timeout=60))

    def check(ours, theirs):
        for key, value in ours.items():
            if key in ("across_gap", "facing_away"):
                value = {"count": value, "places": theirs[key]["places"]}
            if isinstance(value, dict):
                check(value, theirs[key])
            elif isinstance(value, numpy.ndarray):
                assert value.tolist() == theirs[key]
            else:
                assert value == theirs[key], key

    check(filigree.info(mesh), said("info", "mesh.ply"))
    check(filigree.info(model), said("info", "model.fil"))
    check({"fidelity": model.fidelity()}, said("info", "model.fil"))
    check(filigree.compare(filigree.read_mesh("bent.ply"), mesh), said("compare", "bent.ply", "mesh.ply"))


def test_picture(program, mesh):
    program("render", write(mesh), "-o", "theirs.png", "--size", "160x120", "--passes", 2)
    ours = filigree.render(filigree.read_mesh("mesh.ply"), width=160, height=120, passes=2)
    assert numpy.array_equal(ours, filigree.read_picture("theirs.png"))
    filigree.write_picture(ours, "ours.png")
    assert is_same_file("ours.png", "theirs.png")


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_threads_do_not_matter(mesh, model, pose, threads):
    assert filigree.strip(mesh, base=200, threads=threads).tobytes() == model.tobytes()
    restored = filigree.Restorer(model).positions(pose, threads=threads)
    assert restored.tobytes() == filigree.Restorer(model).positions(pose).tobytes()
