"""filigree.fit: any positions in, a model and poses out that follow them within the error."""

import numpy
import pytest

import filigree


def waves(mesh, frames=6):
    rest = numpy.array(mesh.world_vertices)
    size = numpy.ptp(rest, axis=0).max()
    all_frames = []
    for k in range(frames):
        moved = rest.copy()
        moved[:, 2] += 0.06 * size * numpy.sin(7 * rest[:, 0] / size - k) * numpy.cos(3 * rest[:, 1] / size)
        moved[:, 0] += 0.3 * k * size
        all_frames.append(moved)
    return numpy.array(all_frames, dtype=numpy.float32)


def rms(model, poses, frames):
    restorer = filigree.Restorer(model)
    squared = [((restorer.mesh(pose).world_vertices - frame) ** 2).sum(axis=1).mean() for pose, frame in zip(poses, frames)]
    return numpy.sqrt(numpy.mean(squared)) / model.report["diagonal_units"]


def test_gradients_stay_sound():
    """A bar that is twisted, with twenty vertices for each of the driver's: nothing grows by a half."""
    mesh = filigree.make("bar", resolution=8)
    rest = numpy.array(mesh.world_vertices)
    x, (y, z) = rest[:, 0], (rest - rest.mean(0)).T[1:]
    part = numpy.clip(((x - x.min()) / numpy.ptp(x) - 0.4) / 0.2, 0, 1)
    frames = []
    for turn in numpy.radians([0, 40, 80, 120, 160])[:, None] * part:
        frames.append(numpy.stack([x, numpy.cos(turn) * y - numpy.sin(turn) * z, numpy.sin(turn) * y + numpy.cos(turn) * z], 1))
    most = {}
    for sound in (False, True):
        model, poses = filigree.fit(mesh, numpy.array(frames, dtype=numpy.float32), base=60, sound_gradients=sound)
        most[sound] = max(numpy.linalg.det(numpy.asarray(pose.gradients)).max() for pose in poses)
        assert model.report["rms"] < 2e-3
    assert most[True] < 1.5 < most[False], most


def test_an_error_is_reached():
    mesh = filigree.make("wavy-sphere", resolution=32)
    frames = waves(mesh)
    model, poses = filigree.fit(mesh, frames, error=3e-4, frames_per_second=25)
    assert len(poses) == len(frames) and poses.frames_per_second == 25
    assert len(poses[0].gradients) == model.report["driver_vertices"]
    assert rms(model, poses, frames) == pytest.approx(model.report["rms"], rel=1e-3)
    assert model.report["rms"] <= 3e-4 < 30 * model.report["rms"]
    finer, _ = filigree.fit(mesh, frames, error=5e-5)
    assert finer.report["driver_vertices"] > model.report["driver_vertices"]
    small, _ = filigree.fit(mesh, frames, base=100)
    assert small.report["driver_vertices"] == 100


def test_kinds_of_arrays():
    mesh = filigree.make("wavy-sphere", resolution=16)
    frames = waves(mesh)
    one = filigree.fit(mesh, frames, base=80)[1]
    for other in (frames.astype(float), list(frames), numpy.asfortranarray(frames)):
        assert (filigree.fit(mesh, other, base=80)[1].positions == one.positions).all()
    far = filigree.Mesh(numpy.array(mesh.world_vertices) + 1e6, mesh.faces)
    model, poses = filigree.fit(far, frames.astype(float) + 1e6, base=80)
    assert model.report["rms"] < 5 * filigree.fit(mesh, frames, base=80)[0].report["rms"]


def test_the_rest_may_be_a_frame():
    mesh = filigree.make("wavy-sphere", resolution=16)
    frames = waves(mesh)
    model, _ = filigree.fit(mesh, frames, base=80, rest_frame=3)
    assert (model.mesh.vertices == frames[3]).all()
    filigree.fit(mesh, frames, base=80, rest_frame="best")


def test_wrong_calls():
    mesh = filigree.make("wavy-sphere", resolution=8)
    frames = waves(mesh)
    with pytest.raises(filigree.MismatchError, match="one a vertex of the mesh"):
        filigree.fit(mesh, frames[:, :-1])
    with pytest.raises(filigree.MismatchError):
        filigree.fit(mesh, frames[0])
    with pytest.raises(filigree.UnsuitableError, match="no frames"):
        filigree.fit(mesh, frames[:0])
    with pytest.raises(filigree.UsageError, match="error must be above 0"):
        filigree.fit(mesh, frames, error=0)
    with pytest.raises(filigree.UsageError, match="rest_frame"):
        filigree.fit(mesh, frames, rest_frame="first")
    with pytest.raises(filigree.UsageError, match="rest_frame is 6"):
        filigree.fit(mesh, frames, rest_frame=6)
    shuffled = frames.copy()
    noise = numpy.random.default_rng(1).normal(size=frames[2].shape)
    with pytest.raises(filigree.UnsuitableError, match="The error is not reached: a driver of"):
        shuffled[2] += 0.02 * noise
        filigree.fit(mesh, shuffled, error=1e-5)
    frames[4, 7] = numpy.nan
    with pytest.raises((filigree.UsageError, ValueError)):
        filigree.fit(mesh, frames)


def test_progress_cancels():
    mesh = filigree.make("wavy-sphere", resolution=64)
    with pytest.raises(filigree.Cancelled):
        filigree.fit(mesh, waves(mesh), progress=lambda phase, fraction: False)
