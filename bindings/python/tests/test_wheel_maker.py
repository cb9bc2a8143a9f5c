"""What makes wheels: says how far it is, refuses what would not run elsewhere, and packs what PEP 427 asks for."""

import importlib.util
import itertools
import os
import subprocess
import zipfile
from pathlib import Path

import pytest

import filigree

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def maker():
    spec = importlib.util.spec_from_file_location("maker", ROOT / "bindings/python/packaging/filigree_wheel.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def fake_cmake(tmp_path, monkeypatch):
    def make(script):
        (tmp_path / "cmake").write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / "cmake").chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")

    return make


def test_it_says_how_far_it_is(maker, fake_cmake, monkeypatch):
    fake_cmake('for k in 1 2 3 4; do echo "[$k/4] Building CXX object $k"; done')
    clock = itertools.count(0, 40)  # each look is forty seconds later
    monkeypatch.setattr(maker.time, "monotonic", lambda: next(clock))
    said = []
    monkeypatch.setattr(maker, "say", said.append)
    maker.compile_module(Path("build"))
    assert said[0] == "compiled 1 of 4 parts in 40 s; about 2 minutes left"
    assert said[-1].startswith("compiled in ")


def test_what_the_compiler_says_is_kept(maker, fake_cmake):
    fake_cmake('echo "[1/4] Building"; echo "error: nothing there"; exit 1')
    with pytest.raises(SystemExit, match="the compiler stopped; its last lines:\n.*\nerror: nothing there"):
        maker.compile_module(Path("build"))


def module_that_needs(tmp_path, libraries):
    """A shared library that links these."""
    (tmp_path / "module.c").write_text("int answer(void) { return 42; }\n")
    made = tmp_path / "_core.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", made, tmp_path / "module.c", "-Wl,--no-as-needed", *libraries], check=True)
    return {"filigree/_core.so": made.read_bytes()}


def test_the_tag_is_what_the_module_needs(maker, tmp_path):
    tag = maker.portable_tag(module_that_needs(tmp_path, ["-lm"]))
    assert tag.startswith("manylinux_2_") and tag.endswith(os.uname().machine)
    with pytest.raises(SystemExit, match="needs libz.so.1, which a wheel for other machines may not"):
        maker.portable_tag(module_that_needs(tmp_path, ["-l:libz.so.1"]))


def test_a_wheel_is_whole(maker, tmp_path):
    licence = tmp_path / "eigen.txt"
    licence.write_text("MPL")
    name = maker.write_wheel(tmp_path, {"filigree/__init__.py": b"x = 1\n"}, "manylinux_2_34_x86_64", [licence])
    assert name == f"filigree_mesh-{filigree.__version__}-{maker.python_tag()}-{maker.python_tag()}-manylinux_2_34_x86_64.whl"
    with zipfile.ZipFile(tmp_path / name) as wheel:
        info = f"filigree_mesh-{filigree.__version__}.dist-info"
        assert f"{info}/licences/eigen.txt" in wheel.namelist() and f"{info}/LICENSE" in wheel.namelist()
        assert "Requires-Dist: numpy" in wheel.read(f"{info}/METADATA").decode()
        recorded = [line.split(",")[0] for line in wheel.read(f"{info}/RECORD").decode().splitlines()]
        assert sorted(recorded) == sorted(wheel.namelist())
    again = tmp_path / "again"
    again.mkdir()
    maker.write_wheel(again, {"filigree/__init__.py": b"x = 1\n"}, "manylinux_2_34_x86_64", [licence])
    assert (again / name).read_bytes() == (tmp_path / name).read_bytes()
