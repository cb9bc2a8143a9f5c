"""Lays out the manual's sources for Sphinx: docs/ as it is, and pages made from headers, docstrings and the program.

Usage: stage.py ROOT FILIGREE OUT
Links of docs/*.md that leave docs/ become links to a copy of the file, shown as a page. Needs doxygen.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cpp_reference
import python_reference

# The manual's order: what a reader needs first stands first. Every page of docs/ is in one of these; of a folder the
# README.md, which links to the folder's other pages.
PARTS = {
    "Tutorials": ["tutorials/README"],
    "First steps": ["command-line", "python", "blender", "studio", "gallery"],
    "Guides": ["blend-code", "fitting", "flesh", "packing", "handles", "bodies", "bodies-theory", "scenes", "fracture", "melting", "remesh", "inside-points", "rendering", "exchange", "cluster", "web", "live", "site", "runtime"],
    "File formats": ["formats", "animations", "fil-format"],
    "How it works": ["reference-code", "figures", "benchmarks", "reliability", "conventions", "platforms", "architecture", "decisions/README", "contributing", "dependencies", "releasing"],
}
PROGRAM_FOLDERS = ["apps/cli", "apps/studio", "bench/interactive", "report", "bindings/python/src", "bindings/python/filigree",
                   "addons/blender"]
CODE = {".cpp": "cpp", ".h": "cpp", ".py": "python", ".toml": "toml", ".sh": "bash"}


def stage(root, program, out):
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(root / "docs", out, ignore=shutil.ignore_patterns("manual", "*.mp4"))
    pages = {str(page.relative_to(out).with_suffix("")) for page in [*out.glob("*.md"), *out.glob("*/README.md")]}
    listed = {page for names in PARTS.values() for page in names}
    if pages != listed:
        sys.exit(f"stage.py: pages of docs/ and of PARTS differ: {sorted(pages ^ listed)}")
    for path in list(out.rglob("*.md")):
        path.write_text(_with_files_as_pages(path, root, out))
    for path in out.glob("*/README.md"):
        path.write_text(_with_its_folder(path))
    shutil.copytree(root / "docs/gallery", out / "gallery", dirs_exist_ok=True)
    reference = out / "reference"
    reference.mkdir()
    (reference / "commands.md").write_text(_commands(program))
    (reference / "sources.md").write_text(_sources(root))
    cpp_reference.write(root, reference)
    python_reference.write(reference)
    (out / "index.md").write_text(_index(root, out))


def _with_files_as_pages(path, root, out):
    """A page of docs/ whose links to files outside of docs/ lead to pages that show them."""
    folder = path.parent.relative_to(out)
    return _relinked(path.read_text(), r"\.\./[^)#]+", root / "docs" / folder, path, root, out)


def _relinked(text, target, base, path, root, out):
    """Links to files that `target` matches lead to pages that show the files; a link to a folder becomes its label."""
    def page_of(match):
        label, file = match.group(1), (base / match.group(2)).resolve()
        if file.is_dir():
            return label
        if not file.is_file():
            sys.exit(f"stage.py: a link of {path.relative_to(out)} leads to nothing: {match.group(2)}")
        if file.is_relative_to(root / "docs"):
            return match.group(0)
        relative = file.relative_to(root)
        page = out / "files" / f"{relative}.md"
        page.parent.mkdir(parents=True, exist_ok=True)
        fence = f"```{CODE.get(file.suffix, 'text')}\n{file.read_text()}```\n"
        page.write_text(f"---\norphan: true\n---\n\n# {relative}\n\n{fence}")
        return f"[{label}]({os.path.relpath(page, path.parent)})"

    return re.sub(rf"\[([^]]*)\]\(({target})\)", page_of, text)


def _with_its_folder(readme):
    """A folder's README.md, its pages in the sidebar in the order of its links."""
    text = readme.read_text()
    linked = re.findall(r"\]\(([\w-]+)\.md\)", text)
    if sorted(linked) != sorted(page.stem for page in readme.parent.glob("*.md") if page != readme):
        sys.exit(f"stage.py: the pages of {readme.parent.name}/ and those that its README.md links to differ")
    return "\n".join([text, "```{toctree}", ":hidden:", "", *linked, "```", ""])


def _sources(root):
    """Every source file with the first sentence of its comment, by layer and room."""
    drawing = subprocess.run([root / "scripts/layers", "--drawing"], capture_output=True, text=True, check=True).stdout
    folders = ["include/filigree", *(f"src/filigree/{row.split()[-1]}" for row in drawing.splitlines()),
               *PROGRAM_FOLDERS]
    lines = ["# Source files", "", "Each file with the first sentence of its comment. A `.cpp` and the `.h` of its name are one row. A "
             "`.cpp` without a comment of its own is named with the header that it implements.", ""]
    for folder in folders:
        rooms = {}
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".h", ".cpp", ".py") and not (file.suffix == ".cpp" and file.with_suffix(".h").exists()):
                row = f"| `{file.name}` | {_purpose(file, root / 'include')} |"
                rooms.setdefault(file.parent.relative_to(root), []).append(row)
        for room, rows in rooms.items():
            lines += [f"## {room}", "", "| file | what it is |", "|---|---|", *rows, ""]
    return "\n".join(lines)


def _purpose(file, include):
    """The first sentence of the comment or the docstring that a file begins with, fit for a table of Markdown."""
    text = file.read_text()
    comment = re.match(r'(?:// .*\n)+', text) or re.match(r'"""[^"]*"""', text)
    words = re.sub(r'^// |"""', "", comment.group(0), flags=re.MULTILINE) if comment else ""
    if not words or words.startswith("Based on"):
        header = re.search(r'#include "(.+)"', text)
        words = f"Part of `{header.group(1)}`." if header and (include / header.group(1)).exists() else ""
    sentence = re.split(r"(?<=\.)\s", " ".join(words.split()))[0]
    return re.sub(r"([|*<])", r"\\\1", sentence)


def _commands(program):
    """Every command's own help."""
    def help_of(*words):
        return subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True).stdout.rstrip()

    whole = help_of()
    names = re.findall(r"^  ([a-z]+)  ", whole.split("Subcommands:")[1].split("Examples:")[0], re.MULTILINE)
    lines = ["# Command line", "", "What the program says of itself; [the guide](../command-line.md) shows each command at work.", "", f"```\n{whole}\n```", ""]
    for name in names:
        lines += [f"## {name}", "", f"```\n{help_of(name)}\n```", ""]
    return "\n".join(lines)


def _index(root, out):
    """The start page: the README up to its list of pages, and the parts for the sidebar."""
    readme = (root / "README.md").read_text().split("## Where to read on")[0]
    readme = _relinked(readme, r"(?!docs/|https?:)[^)#]+", root, out / "index.md", root, out)
    lines = [re.sub(r"\]\(docs/", "](", readme)]
    parts = PARTS | {"Reference": ["reference/commands", "reference/cpp/index", "reference/python", "reference/sources"]}
    for part, names in parts.items():
        lines += ["```{toctree}", ":hidden:", ":maxdepth: 1", f":caption: {part}", "", *names, "```", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    stage(Path(sys.argv[1]).resolve(), os.path.abspath(sys.argv[2]), Path(sys.argv[3]).resolve())
