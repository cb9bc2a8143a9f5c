"""Skins, flesh, and bodies that follow targets."""

import subprocess
import sys
from pathlib import Path

import numpy
import pytest

import filigree

MAN = Path(__file__).resolve().parents[3] / "examples/python/walking_man.py"


@pytest.fixture(scope="module")
def skin(tmp_path_factory):
    path = tmp_path_factory.mktemp("flesh") / "man.glb"
    subprocess.run([sys.executable, MAN, path], check=True, stdout=subprocess.DEVNULL)
    return filigree.read_skin(path)


def test_a_skin_says_what_it_has(skin):
    assert [name for name, _ in skin.clips] == ["Walk", "Jump"]
    assert skin.clips[0][1] == pytest.approx(1.1)
    assert skin.joints[0] == "Hips" and skin.parents[0] is None
    assert skin.joints[skin.parents[skin.joints.index("LeftLeg")]] == "LeftUpLeg"
    moved = skin.positions("Walk", 0.3)
    assert moved.shape == skin.mesh.world_vertices.shape
    assert 0.3 < numpy.abs(moved - skin.mesh.world_vertices).max() < 1.5
    assert skin.transforms(0, 0.3).shape == (len(skin.joints), 4, 4)
    with pytest.raises(filigree.UsageError, match="'Walk', 'Jump'"):
        skin.positions("Run", 0)
    with pytest.raises(filigree.UsageError):
        skin.transforms(7, 0)


def test_flesh_follows_and_keeps_its_volume(skin):
    flesh = filigree.Flesh(skin, particles=600, clips=["Walk"])
    assert flesh.scale == 1
    assert numpy.isinf(flesh.frequency).any() and (flesh.frequency < 20).any()
    assert 0 <= flesh.softness.min() and flesh.softness.max() <= 1
    frames, said = flesh.simulate("Walk", frames_per_second=24)
    assert frames.shape == (27, len(skin.mesh.vertices), 3)
    assert said["clamped_particles"] == 0 and said["furthest"] < 0.1
    assert said["volume"][0] > 0.98 and said["skin_volume"][0] < 0.995
    plain = skin.positions("Walk", 0.5)
    assert numpy.sqrt(((frames[12] - plain) ** 2).sum(1).mean()) < 0.05


def test_flesh_is_loose_where_it_is_painted_and_limbs_pass(skin):
    loose = (skin.mesh.world_vertices[:, 1] < 1.3).astype(float)
    firm = filigree.Flesh(skin, particles=400, clips=["Walk"])
    painted = filigree.Flesh(skin, particles=400, clips=["Walk"], loose=loose, through=[("*Hand", "Hips")])
    assert numpy.isinf(painted.frequency).sum() < numpy.isinf(firm.frequency).sum()
    with pytest.raises(filigree.UsageError, match="'Tail'"):
        filigree.Flesh(skin, particles=400, through=[("Tail", "Hips")])


def test_all_clips_leave_as_one_file(skin, tmp_path):
    flesh = filigree.Flesh(skin, particles=400, poisson_ratio=0.3)
    assert flesh.body.material.poisson_ratio == pytest.approx(0.3)
    assert flesh.stretches("Walk", 0.3) is None
    model, poses, said = flesh.export(tmp_path / "soft.glb", frames_per_second=12, joints=40)
    assert list(poses) == list(said) == ["Walk", "Jump"]
    assert len(poses["Walk"]) == 14 and said["Jump"]["clamped_particles"] == 0
    assert model.report["frames"] == len(poses["Walk"]) + len(poses["Jump"]) and model.report["rms"] < 5e-3
    assert [name for name, _ in filigree.read_skin(tmp_path / "soft.glb").clips] == ["Walk", "Jump"]
    with pytest.raises(filigree.UsageError):
        filigree.Flesh(skin, particles=400, poisson_ratio=0.7)


def test_a_rest_shape_grows():
    body = filigree.Body(filigree.make("bar", resolution=4), "jelly", particles=200)
    count = len(body.rest)
    large, free, still = 1.2 * body.rest, numpy.zeros(count), numpy.zeros((count, 3))
    stretches = numpy.tile(1.2 * numpy.eye(3), (count, 1, 1))
    simulation = filigree.Simulation([body], automatic_rigid=False, mode="explicit", gravity=(0, 0, 0))
    simulation.set_positions(0, large)
    simulation.set_follow(0, free, large, still, leash=numpy.inf, stretches=stretches)
    simulation.set_targets(0, large, still, stretches=stretches)
    simulation.step()
    assert numpy.allclose(simulation.positions(0), large, atol=1e-5)
    with pytest.raises(filigree.UsageError, match="symmetric"):
        simulation.set_targets(0, large, still, stretches=numpy.tile([[1, 1, 0], [0, 1, 0], [0, 0, 1.0]], (count, 1, 1)))


def test_a_moving_surface_is_a_skin_too(tmp_path):
    bar = filigree.make("bar", resolution=8)
    frames = numpy.stack([bar.world_vertices + [0, 0.2 * numpy.sin(t / 4), 0] for t in range(20)])
    filigree.write_animation(bar, frames, tmp_path / "bar.pc2")
    few = filigree.read_skin(tmp_path / "bar.pc2", mesh=bar, frames_per_second=24, patches=12)
    skin = filigree.read_skin(tmp_path / "bar.pc2", mesh=bar, frames_per_second=24)
    assert len(few.joints) < len(skin.joints)
    assert skin.clips[0][0] == "bar" and skin.clips[0][1] == pytest.approx(19 / 24)
    assert numpy.allclose(skin.positions(0, 6 / 24), frames[6], atol=1e-5)
    with pytest.raises(filigree.UnsuitableError, match="positions alone"):
        filigree.read_skin(tmp_path / "bar.pc2")


def test_a_body_follows_targets():
    body = filigree.Body(filigree.make("bar", resolution=4), "jelly", particles=200)
    simulation = filigree.Simulation([body], automatic_rigid=False, mode="explicit")
    count = len(body.rest)
    start, still = body.rest, numpy.zeros((count, 3))
    simulation.set_follow(0, numpy.full(count, numpy.inf), start, still)
    simulation.set_targets(0, start + [0.1, 0, 0], still)
    simulation.step()
    assert numpy.allclose(simulation.positions(0), start + [0.1, 0, 0], atol=1e-5)
    simulation.set_follow(0, None)
    with pytest.raises(filigree.UsageError, match="set_follow"):
        simulation.set_targets(0, start, still)
    with pytest.raises(filigree.UsageError, match="frequency"):
        simulation.set_follow(0, [1.0], start, still)
    with pytest.raises(filigree.UsageError):
        simulation.set_follow(0, numpy.ones(count))


def test_what_has_no_skin_is_refused(tmp_path):
    path = tmp_path / "plain.glb"
    filigree.write_mesh(filigree.make("bar", resolution=2), path)
    with pytest.raises(filigree.UnsuitableError, match="no skin"):
        filigree.read_skin(path)
