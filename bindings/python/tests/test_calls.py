"""Wrong calls are told in one sentence; objects that nobody initialised and old pickles raise no more than that."""

import copy
import inspect
import pickle

import numpy
import pytest

import filigree


def sentence(call, kind=TypeError):
    with pytest.raises(kind) as caught:
        call()
    said = str(caught.value)
    assert said and said[-1] in ".?" and "\n" not in said, said
    assert "incompatible" not in said and "Invoked" not in said, said
    return said


def test_wrong_names(mesh, model):
    assert sentence(lambda: filigree.strip(mesh, vertices=100)) == \
        "strip() has no parameter 'vertices'; did you mean 'base'?"
    assert "did you mean 'max_edge'?" in sentence(lambda: filigree.strip(mesh, maxedge=0.1))
    assert "did you mean 'levels'?" in sentence(lambda: filigree.strip(mesh, level=2))
    assert "did you mean 'threads'?" in sentence(lambda: filigree.restore(model, model.driver, thread=1))
    said = sentence(lambda: filigree.strip(mesh, xyzzy=3))
    assert "has no parameter 'xyzzy'; it has mesh, driver, base, levels" in said
    assert "did you mean 'faces'?" in sentence(lambda: filigree.Mesh(mesh.vertices, face=mesh.faces))


def test_wrong_counts_and_types(mesh, model):
    said = sentence(lambda: filigree.strip(mesh.vertices, mesh.faces))
    assert said.startswith("strip() takes 1 argument by position and was given 2; others go by name: driver, base,")
    assert sentence(lambda: filigree.strip()) == "strip() needs an argument 'mesh'."
    assert sentence(lambda: filigree.strip(mesh, mesh=mesh)) == \
        "strip() was given 'mesh' twice, by position and by name."
    assert sentence(lambda: filigree.strip(mesh, base="many")) == \
        "strip(): base has to be int or None, and is of type str."
    assert sentence(lambda: filigree.strip(mesh, base=1.5)) == \
        "strip(): base has to be int or None, and is of type float."
    assert sentence(lambda: filigree.strip(mesh, base=-1)) == "strip(): base is -1, and has to be 0 or more."
    assert "has to be filigree.Model, and is of type" in sentence(lambda: filigree.expected_error(mesh, [[0, 0, 0]]))
    sentence(lambda: filigree.Mesh())
    sentence(lambda: model.level("first"))


def test_what_is_right_stays():
    assert list(inspect.signature(filigree.strip).parameters)[:3] == ["mesh", "driver", "base"]
    assert "Take the detail" in filigree.strip.__doc__
    with pytest.raises(filigree.UsageError, match="base"):
        filigree.strip(filigree.make("wavy-sphere", resolution=4), base=2)


def classes():
    return [value for value in vars(filigree._core).values()
            if isinstance(value, type) and not issubclass(value, (Exception, Warning))]


@pytest.mark.parametrize("kind", classes(), ids=lambda kind: kind.__name__)
def test_objects_that_nobody_initialised(kind):
    derived = type("Derived", (kind,), {})
    for made in (kind.__new__(kind), derived.__new__(derived)):
        for name in dir(kind):
            if isinstance(inspect.getattr_static(kind, name), property):
                with pytest.raises(Exception):
                    getattr(made, name)
        for way in (repr, copy.copy, copy.deepcopy, pickle.dumps):
            try:
                way(made)
            except Exception:
                pass

    class Careless(kind):
        def __init__(self):
            pass
    with pytest.raises(TypeError, match="__init__"):
        Careless()


def picklable(mesh, model):
    pose = filigree.bend(model, "z", 30)(model)
    sequence = filigree.PoseSequence(numpy.stack([model.driver.vertices] * 2), 24)
    return [mesh, model, pose, sequence, filigree.Restorer(model), filigree.Material("rubber")]


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickles_of_every_protocol(protocol, mesh, model):
    for one in picklable(mesh, model):
        try:
            bytes_ = pickle.dumps(one, protocol)
        except TypeError as failed:
            assert str(failed)
            with pytest.raises(TypeError):
                pickle.dumps(one)  # then by none
            continue
        back = pickle.loads(bytes_)
        assert type(back) is type(one)
        assert pickle.dumps(back, 4) == pickle.dumps(one, 4)
    body = filigree.Body(filigree.make("bar"), particles=50)
    for unpicklable in (body, filigree.bend(model, "z", 30), filigree.InsideTest(mesh)):
        with pytest.raises(TypeError, match="pickle"):
            pickle.dumps(unpicklable, protocol)
