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

# The manual's order: what a reader needs first stands first. Every page of docs/ is in one of these.
PARTS = {
    "First steps": ["command-line", "python", "blender", "studio", "gallery"],
    "Guides": ["blend-code", "coding", "handles", "bodies", "bodies-theory", "scenes", "fracture", "melting", "remesh", "inside-points", "rendering", "exchange", "cluster", "web"],
    "File formats": ["formats", "animations", "fil-format"],
    "How it works": ["reference-code", "figures", "benchmarks", "reliability", "conventions", "architecture", "contributing"],
}
CODE = {".cpp": "cpp", ".h": "cpp", ".py": "python", ".toml": "toml", ".sh": "bash"}


def stage(root, program, out):
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(root / "docs", out, ignore=shutil.ignore_patterns("manual", "*.mp4"))
    pages = {page.stem for page in (root / "docs").glob("*.md")}
    listed = {page for names in PARTS.values() for page in names}
    if pages != listed:
        sys.exit(f"stage.py: pages of docs/ and of PARTS differ: {sorted(pages ^ listed)}")
    for page in pages:
        path = out / f"{page}.md"
        path.write_text(_with_files_as_pages(path.read_text(), root, out))
    shutil.copytree(root / "docs/gallery", out / "gallery", dirs_exist_ok=True)
    reference = out / "reference"
    reference.mkdir()
    (reference / "commands.md").write_text(_commands(program))
    cpp_reference.write(root, reference)
    python_reference.write(reference)
    (out / "index.md").write_text(_index(root))


def _with_files_as_pages(text, root, out):
    def page_of(match):
        label, target = match.group(1), match.group(2)
        path = (root / "docs" / target).resolve()
        if not path.is_file():
            sys.exit(f"stage.py: a link leads to nothing: {target}")
        relative = path.relative_to(root)
        page = out / "files" / f"{relative}.md"
        page.parent.mkdir(parents=True, exist_ok=True)
        fence = f"```{CODE.get(path.suffix, 'text')}\n{path.read_text()}```\n"
        page.write_text(f"---\norphan: true\n---\n\n# {relative}\n\n{fence}")
        return f"[{label}](files/{relative}.md)"

    return re.sub(r"\[([^]]*)\]\((\.\./[^)#]+)\)", page_of, text)


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


def _index(root):
    """The start page: the README up to its list of pages, and the parts for the sidebar."""
    readme = (root / "README.md").read_text().split("## Where to read on")[0]
    lines = [re.sub(r"\]\((docs/)?", "](", readme)]
    parts = PARTS | {"Reference": ["reference/commands", "reference/cpp/index", "reference/python"]}
    for part, names in parts.items():
        lines += ["```{toctree}", ":hidden:", ":maxdepth: 1", f":caption: {part}", "", *names, "```", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    stage(Path(sys.argv[1]).resolve(), os.path.abspath(sys.argv[2]), Path(sys.argv[3]).resolve())
