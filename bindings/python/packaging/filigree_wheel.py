"""What pip asks to make a wheel (PEP 517), with the standard library and CMake alone.

The library is built in build/release where scripts/build has begun there, else in build/wheel, or where
`--config-settings build=FOLDER` says: the library and the module alone, without programs, tests and the studio. What is
being compiled, and for how long still, is said on the terminal, which pip would hide, and to `pip install -v`.
The wheel holds the module and the shared libraries of ours beside it; those of the system are needed where it runs.
scripts/wheel makes wheels of modules that need none (portable_tag).
"""

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
NAME = "filigree_mesh"  # on an index; `filigree` is another project's there
# What every glibc Linux has (the libraries that PEP 600 names, but for libstdc++, whose age would matter).
OF_EVERY_LINUX = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2",
                  "ld-linux-aarch64.so.1"}  # fmt: skip


def version():
    return re.search(r"project\(filigree VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def python_tag():
    return f"cp{sys.version_info.major}{sys.version_info.minor}"


def tag(platform=None):
    platform = platform or sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python_tag()}-{python_tag()}-{platform}"


def metadata():
    return (
        f"Metadata-Version: 2.1\nName: filigree-mesh\nVersion: {version()}\nRequires-Python: >=3.9\n"
        "Requires-Dist: numpy\nLicense: MIT\n"
        "Summary: Takes detail off a mesh, lets anything move what is left, puts the detail back\n"
    )


def run(*command):
    subprocess.run([str(word) for word in command], check=True, cwd=ROOT)


def say(sentence):
    """To the log that `pip install -v` shows, and to the terminal: pip hides the log unless something fails."""
    print(f"filigree: {sentence}", flush=True)
    try:
        with open("/dev/tty", "w") as terminal:
            terminal.write(f"\r  filigree: {sentence}\n")
    except OSError:  # there is none
        pass


def minutes(seconds):
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} minutes"


def compile_module(folder):
    """Says every half minute how far it is; every line of the compiler goes to the log."""
    command = ["cmake", "--build", str(folder), "--target", "filigree_python", "-j", str(os.cpu_count() or 1)]
    begun = said = time.monotonic()
    lines = []
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            lines.append(line)
            step = re.match(r"\[(\d+)/(\d+)\]", line)
            now = time.monotonic()
            if step and now - said > 30:
                done, of = map(int, step.groups())
                left = minutes((now - begun) * (of - done) / max(done, 1))
                say(f"compiled {done} of {of} parts in {minutes(now - begun)}; about {left} left")
                said = now
    if process.returncode != 0:
        sys.exit(f"filigree: the compiler stopped; its last lines:\n{''.join(lines[-20:])}")
    if time.monotonic() - begun > 5:
        say(f"compiled in {minutes(time.monotonic() - begun)}")


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
            cores = os.cpu_count() or 1
            say(f"compiling the library in {folder}: ten processor minutes, about {minutes(600 / cores)} here, once")
        # The interpreter itself: a virtual environment goes, and the build stays.
        python = f"-DPython3_EXECUTABLE={os.path.realpath(sys.executable)}"
        run("cmake", "--preset", "release", "-B", folder, "-DFILIGREE_PYTHON=ON", python, *first)
    compile_module(folder)


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


def portable_tag(files):
    """The manylinux tag of a package that needs nothing but what every Linux has; else says what else it needs."""
    newest = (2, 17)
    for name, content in files.items():
        if ".so" not in name:
            continue
        with tempfile.NamedTemporaryFile() as copy:
            copy.write(content)
            copy.flush()
            read = subprocess.run(["readelf", "-dV", "-W", copy.name], check=True, capture_output=True, text=True).stdout
        needed = set(re.findall(r"\(NEEDED\).*\[(.*)\]", read)) - OF_EVERY_LINUX
        if needed:
            sys.exit(f"{name} needs {', '.join(sorted(needed))}, which a wheel for other machines may not")
        for found in re.findall(r"Name: GLIBC_(\d+)\.(\d+)", read):
            newest = max(newest, tuple(map(int, found)))
    return f"manylinux_{newest[0]}_{newest[1]}_{os.uname().machine}"


def record(files):
    def digest(content):
        return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()

    return "".join(f"{name},sha256={digest(content)},{len(content)}\n" for name, content in sorted(files.items()))


def write_wheel(wheel_directory, files, platform=None, licences=()):
    """files: of the package, by name. licences: files with the licence texts of what is compiled in."""
    info = f"{NAME}-{version()}.dist-info"
    files = dict(files)
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = (
        f"Wheel-Version: 1.0\nGenerator: filigree\nRoot-Is-Purelib: false\nTag: {tag(platform)}\n".encode()
    )
    files[f"{info}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
    for licence in licences:
        files[f"{info}/licences/{licence.name}"] = licence.read_bytes()
    files[f"{info}/RECORD"] = (record(files) + f"{info}/RECORD,,\n").encode()
    name = f"{NAME}-{version()}-{tag(platform)}.whl"
    with zipfile.ZipFile(Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, content in sorted(files.items()):
            entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))  # the same files, the same wheel
            entry.external_attr = 0o644 << 16
            wheel.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return name


def get_requires_for_build_wheel(config_settings=None):
    return []


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    name = f"{NAME}-{version()}.dist-info"
    (Path(metadata_directory) / name).mkdir()
    (Path(metadata_directory) / name / "METADATA").write_text(metadata())
    return name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    folder = build_folder(config_settings)
    build(folder)
    return write_wheel(wheel_directory, package_files(folder))


def build_sdist(sdist_directory, config_settings=None):
    sys.exit("Filigree has no source package of its own; take a clone, and `pip install .` there.")


def main(folder, licences, wheel_directory):
    """Packs a module that scripts/wheel has built, for any Linux with the same glibc or a newer one."""
    files = package_files(Path(folder))
    print(write_wheel(wheel_directory, files, portable_tag(files), sorted(Path(licences).iterdir())))


if __name__ == "__main__":
    main(*sys.argv[1:])
