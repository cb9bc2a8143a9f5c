"""A driver that was made elsewhere has vertices of its own: nothing that is restored or written has them."""

import numpy
import pytest

import filigree


@pytest.fixture(scope="module")
def cage():
    return filigree.make("wavy-sphere", resolution=6, amplitude=0)


def test_restored_meshes_have_the_meshs_own_vertices(mesh, cage, tmp_path):
    model = filigree.strip(mesh, driver=cage)
    count = len(mesh.vertices)
    assert len(model.mesh.vertices) == len(model.level(1).vertices) == count
    assert f"{count} vertices" in repr(model)
    assert numpy.array_equal(model.driver.vertices, cage.vertices) and len(model.level(0).vertices) == len(cage.vertices)
    restorer = filigree.Restorer(model)
    assert len(restorer) == count and restorer.positions(cage.vertices).shape == (count, 3)
    restored = filigree.restore(model, cage.vertices)
    assert filigree.compare(mesh, restored)["rms"] < 1e-3
    assert numpy.array_equal(restored.faces, mesh.faces)

    filigree.write_model(model, tmp_path / "m.fil")
    again = filigree.read_model(tmp_path / "m.fil")
    assert len(again.mesh.vertices) == count and len(filigree.Restorer(again)) == count
    assert filigree.info(again)["levels"][-1]["vertices"] == count
    bend = filigree.bend(mesh, "z", 40)
    assert filigree.compare(filigree.restore(again, bend(again)), bend(mesh))["rms"] < 1e-2
