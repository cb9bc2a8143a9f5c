"""Every name has a docstring that says what it takes; every example in one runs; the types are right."""

import doctest
import inspect
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy
import pytest

import filigree

CODE = [getattr(filigree, name) for name in filigree.__all__]
CLASSES = [thing for thing in CODE if inspect.isclass(thing) and not issubclass(thing, BaseException)]
FIELDS = {(kind, name) for kind in CLASSES for name in getattr(kind, "_fields", ())}  # of named tuples
METHODS = [
    (f"{kind.__name__}.{name}", member)
    for kind in CLASSES
    for name, member in vars(kind).items()
    if (not name.startswith("_") or name == "__call__") and (kind, name) not in FIELDS
]
NAMED = [(thing.__name__, thing) for thing in CODE] + METHODS


def test_everything_public_is_named():
    assert filigree.__all__ == sorted(name for name in dir(filigree) if not name.startswith("_"))
    assert set(filigree.__all__) >= {name for name in dir(filigree._core) if not name.startswith("_")}


def test_the_version_is_cmakes():
    cmake = (Path(__file__).resolve().parents[3] / "CMakeLists.txt").read_text()
    assert filigree.__version__ == re.search(r"project\(filigree VERSION ([0-9.]+)", cmake).group(1)


@pytest.mark.parametrize("name, thing", NAMED, ids=[name for name, _ in NAMED])
def test_docstrings(name, thing):
    assert thing.__doc__ and len(thing.__doc__) > 3
    if isinstance(thing, property) or inspect.isclass(thing):
        return
    thing = thing.__func__ if isinstance(thing, staticmethod) else thing
    said = inspect.signature(thing)
    if name in filigree.__all__ and not any(words in thing.__doc__ for words in ("As of", "as of", "see `")):
        for parameter in said.parameters.values():
            if parameter.name not in ("path", "picture", "threads", "progress"):
                assert parameter.name in thing.__doc__, parameter.name


@pytest.mark.parametrize("name, thing", NAMED + [("filigree", filigree)], ids=[name for name, _ in NAMED] + ["filigree"])
def test_examples(name, thing, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(thing.__doc__, {"filigree": filigree, "numpy": numpy}, name, None, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert doctest.DocTestRunner().run(example).failed == 0


def test_help_is_worth_reading():
    text = subprocess.run(
        [sys.executable, "-c", "import filigree; help(filigree.strip)"], capture_output=True, text=True, check=True
    ).stdout
    assert "strip(mesh, *, driver=None, base=None" in text and "fraction of the diagonal" in text and "Examples" in text


def test_stubs():
    folder = Path(filigree.__file__).parent.parent
    allowed = Path(__file__).parent / "stubs_allowed.txt"
    checked = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "filigree", "--allowlist", str(allowed)],
        cwd=folder,
        env={**os.environ, "MYPYPATH": str(folder), "MYPY_CACHE_DIR": os.devnull},
        capture_output=True,
        text=True,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_types_are_understood(tmp_path):
    (tmp_path / "use.py").write_text(
        "import filigree\n"
        "model = filigree.strip(filigree.make('torus'), base=100)\n"
        "reveal_type(filigree.Restorer(model).mesh(model.driver.vertices).vertices)\n"
        "filigree.strip(mesh=5, bass=3)\n"
    )
    said = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", os.devnull, "use.py"],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(Path(filigree.__file__).parent.parent)},
        capture_output=True,
        text=True,
    ).stdout
    assert "floating[numpy._typing._32Bit]" in said and '"bass"' in said


@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_pages(page, tmp_path, monkeypatch):
    """What pages show runs, block after block."""
    root = Path(__file__).resolve().parents[3]
    monkeypatch.chdir(tmp_path)
    blocks = (root / page).read_text().split("```python\n")[1:]
    assert blocks
    names = {}
    for block in blocks:
        exec(block.split("```")[0], names)


def keys_of_scenes():
    """Every key of docs/scenes.md, which is the table that the reader of scenes goes by: (table, key, what holds without)."""
    table = None
    for line in (Path(__file__).resolve().parents[3] / "docs/scenes.md").read_text().splitlines():
        if line.startswith("#"):
            table = line.strip("#` []")
        elif table and line.startswith("| `") and line.count(" | ") >= 5:
            cells = [cell.strip("` ") for cell in line.strip("|").split(" | ")]
            yield table, cells[0], cells[3]


def test_a_simulation_takes_what_scenes_say_of_the_world():
    of_scenes_alone = {"frames", "duration"}
    said = inspect.signature(filigree.Simulation).parameters
    found = 0
    for table, key, unset in keys_of_scenes():
        if table not in ("world", "simulation") or key in of_scenes_alone:
            continue
        found += 1
        parameter = said[key.removeprefix("body_")]
        if key != "air_density":  # of which scenes with wind have another
            wanted = {"true": True, "false": False, "auto": "auto"}.get(unset)
            assert parameter.default == (eval(unset.replace("[", "(").replace("]", ")")) if wanted is None else wanted), key
    assert found == 14


def test_a_material_has_what_scenes_say_of_it():
    material = filigree.Material("rubber")
    quantities = [key for table, key, unset in keys_of_scenes() if table == "body" and unset == "by the material"]
    assert len(quantities) == 17
    for key in quantities:
        assert isinstance(getattr(material, key), str if key == "model" else float)
