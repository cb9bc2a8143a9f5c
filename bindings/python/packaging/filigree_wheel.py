"""What pip asks to make a wheel (PEP 517), with the standard library and CMake alone.

The library is built in build/release where scripts/build has begun there, else in build/wheel, or where
`--config-settings build=FOLDER` says: the library and the module alone, without programs, tests and the studio. What is
being compiled is seen with `pip install -v`.
The wheel holds the module and the libraries of ours beside it; those of Debian are needed where it runs.
"""

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def version():
    return re.search(r"project\(filigree VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def metadata():
    return (
        f"Metadata-Version: 2.1\nName: filigree\nVersion: {version()}\nRequires-Python: >=3.9\nRequires-Dist: numpy\n"
        "Summary: Takes detail off a mesh, lets anything move what is left, puts the detail back\n"
    )


def run(*command):
    subprocess.run([str(word) for word in command], check=True, cwd=ROOT)


def build_folder(settings):
    if "build" in (settings or {}):
        return Path(settings["build"]).resolve()
    release = ROOT / "build" / "release"
    return release if (release / "CMakeCache.txt").exists() else ROOT / "build" / "wheel"


def build(folder):
    cache = folder / "CMakeCache.txt"
    if not cache.exists() or "FILIGREE_PYTHON:BOOL=ON" not in cache.read_text():
        first = [] if cache.exists() else [f"-DFILIGREE_{part}=OFF" for part in ("PROGRAMS", "STUDIO", "TESTS", "BENCH")]
        if first:
            print(f"filigree: compiling the library in {folder}: ten processor minutes, once", flush=True)
        # The interpreter itself: a virtual environment goes, and the build stays.
        python = f"-DPython3_EXECUTABLE={os.path.realpath(sys.executable)}"
        run("cmake", "--preset", "release", "-B", folder, "-DFILIGREE_PYTHON=ON", python, *first)
    run("cmake", "--build", folder, "--target", "filigree_python", "-j", os.cpu_count() or 1)


def package_files(folder):
    """Name in the wheel and bytes of each file of the package."""
    with tempfile.TemporaryDirectory() as prefix:
        for component in ("python", "library"):
            run("cmake", "--install", folder, "--component", component, "--prefix", prefix, "--strip")
        module = next(Path(prefix).rglob("filigree/__init__.py")).parent
        files = {f"filigree/{path.name}": path.read_bytes() for path in module.iterdir() if path.is_file()}
        for library in Path(prefix).rglob("libfiligree*.so.*"):
            if library.is_symlink():  # by the names that they are linked under
                files[f"filigree/{library.name}"] = library.read_bytes()
    if not any(f"-{sys.version_info.major}{sys.version_info.minor}-" in name for name in files):
        sys.exit(f"{folder} is built for another Python than {sys.version.split()[0]}; give --config-settings build=FOLDER")
    return files


def record(files):
    def digest(content):
        return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()

    return "".join(f"{name},sha256={digest(content)},{len(content)}\n" for name, content in sorted(files.items()))


def get_requires_for_build_wheel(config_settings=None):
    return []


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    name = f"filigree-{version()}.dist-info"
    (Path(metadata_directory) / name).mkdir()
    (Path(metadata_directory) / name / "METADATA").write_text(metadata())
    return name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    folder = build_folder(config_settings)
    build(folder)
    files = package_files(folder)
    info = f"filigree-{version()}.dist-info"
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: filigree\nRoot-Is-Purelib: false\nTag: {tag()}\n".encode()
    )
    files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    files[f"{info}/RECORD"] = (record(files) + f"{info}/RECORD,,\n").encode()
    name = f"filigree-{version()}-{tag()}.whl"
    with zipfile.ZipFile(Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in sorted(files.items()):
            entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))  # the same files, the same wheel
            entry.external_attr = 0o644 << 16
            wheel.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return name


def build_sdist(sdist_directory, config_settings=None):
    sys.exit("Filigree has no source package of its own; take a clone, and `pip install .` there.")
