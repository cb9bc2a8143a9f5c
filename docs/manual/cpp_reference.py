"""The C++ reference: doxygen reads the public headers, and this writes their declarations and comments as pages, one a
header. Breathe would do the same in five times the time, and shows every template parameter before the sentence."""

import re
import subprocess
import tempfile
import xml.etree.ElementTree as tree
from pathlib import Path

# In the order in which they build on each other.
HEADERS = ["types", "result", "context", "mesh", "strip", "pose", "restore", "fit", "pack", "file", "sample", "remesh",
           "reference", "physics/material", "physics/body", "physics/world", "physics/simulation", "fracture", "skin", "flesh", "scene", "render"]
DOXYFILE = """
INPUT = {inputs}
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
OUTPUT_DIRECTORY = {out}
EXTRACT_ALL = YES
QUIET = YES
WARNINGS = NO
MARKDOWN_SUPPORT = NO
AUTOLINK_SUPPORT = NO
ENABLE_PREPROCESSING = YES
STRIP_FROM_PATH = {src}
"""


def public_headers(root):
    """The headers in include/filigree but for the one that includes the others."""
    folder = root / "include/filigree"
    there = {str(h.relative_to(folder).with_suffix("")) for h in folder.rglob("*.h")} - {"filigree"}
    if there != set(HEADERS):
        raise SystemExit(f"cpp_reference: HEADERS and include/filigree differ: {', '.join(sorted(there ^ set(HEADERS)))}")
    return [folder / f"{name}.h" for name in HEADERS]


def write(root, folder):
    out = folder / "cpp"
    out.mkdir()
    headers = public_headers(root)
    with tempfile.TemporaryDirectory() as work:
        doxyfile = Path(work) / "Doxyfile"
        doxyfile.write_text(DOXYFILE.format(inputs=" ".join(map(str, headers)), out=work, src=root / "include"))
        subprocess.run(["doxygen", doxyfile], check=True, stdout=subprocess.DEVNULL)
        xml = Path(work) / "xml"
        files = {}
        for entry in tree.parse(xml / "index.xml").getroot().findall("compound[@kind='file']"):
            compound = tree.parse(xml / f"{entry.get('refid')}.xml").getroot().find("compounddef")
            files[compound.find("location").get("file").split("include/")[-1]] = compound
        members = {}  # of the namespace, by header
        space = tree.parse(xml / "namespacefiligree.xml").getroot().find("compounddef")
        for member in space.findall("sectiondef/memberdef"):
            members.setdefault(member.find("location").get("file").split("include/")[-1], []).append(member)
        for header in headers:
            name = str(header.relative_to(root / "include"))
            page = _header(name, header, files[name], members.get(name, []), xml)
            (out / f"{header.stem}.rst").write_text("\n".join(page) + "\n")
    index = ["C++", "===", "", "A page a header; ``filigree/filigree.h`` includes those of the core. Everything is in the namespace ``filigree``.", "",
             ".. toctree::", "   :maxdepth: 1", ""]
    (out / "index.rst").write_text("\n".join(index + [f"   {header.stem}" for header in headers]) + "\n")


def _header(name, path, compound, members, xml):
    title = f"``{name}``"
    lines = [title, "=" * len(title), "", *_opening(path), ""]
    for inner in compound.findall("innerclass"):
        if "@" not in inner.text:
            declared = tree.parse(xml / f"{inner.get('refid')}.xml").getroot().find("compounddef")
            if declared.get("prot") == "public" and inner.text.count("::") == 1:
                lines += _class(declared, xml, "")
    for member in members:
        lines += _member(member, "")
    return lines


def _opening(path):
    """The comment that a header begins with; its indented lines are formulas."""
    lines = []
    for line in path.read_text().splitlines():
        if not line.startswith("//"):
            break
        line = line[2:].removeprefix(" ")
        is_formula, was_formula = line.startswith("    "), bool(lines) and lines[-1].startswith("    ")
        if is_formula and not was_formula:
            lines += ["", "::", ""]
        elif was_formula and not is_formula:
            lines.append("")
        lines.append(line if is_formula else _escaped(line))
    return lines


def _class(compound, xml, indent):
    kind = compound.get("kind")
    name = compound.findtext("compoundname").removeprefix("filigree::")
    template = _template(compound)
    directive = "class" if kind == "class" else "union" if kind == "union" else "struct"
    lines = [f"{indent}.. cpp:{directive}:: {template}{name if not indent else name.split('::')[-1]}", ""]
    inner = indent + "   "
    lines += _text(compound, inner)
    for nested in compound.findall("innerclass"):
        if nested.get("prot") == "public":
            lines += _class(tree.parse(xml / f"{nested.get('refid')}.xml").getroot().find("compounddef"), xml, inner)
    for member in compound.findall("sectiondef/memberdef"):
        if member.get("prot") == "public" and not (member.findtext("argsstring") or "").rstrip().endswith(("=delete", "=default")):
            lines += _member(member, inner)
    return lines


def _template(element):
    parameters = element.find("templateparamlist")
    if parameters is None:
        return ""
    shown = []
    for p in parameters.findall("param"):
        words = ["".join(p.find("type").itertext()), p.findtext("declname") or ""]
        default = p.find("defval")
        shown.append(" ".join(filter(None, words)) + (" = " + "".join(default.itertext()) if default is not None else ""))
    return f"template <{', '.join(shown)}> "


def _member(member, indent):
    kind, name = member.get("kind"), member.findtext("name")
    if name.startswith("@") or "@" in "".join(member.find("type").itertext() if member.find("type") is not None else ""):
        return []
    kind_of = {"function": "function", "variable": "member", "typedef": "type", "enum": "enum-class"}
    if kind not in kind_of:
        return []
    type_ = " ".join("".join(member.find("type").itertext()).split()) if member.find("type") is not None else ""
    template = _template(member)
    if kind == "enum":
        lines = [f"{indent}.. cpp:enum-class:: {name}", ""] + _text(member, indent + "   ")
        for value in member.findall("enumvalue"):
            lines += [f"{indent}   .. cpp:enumerator:: {value.findtext('name')}", ""] + _text(value, indent + "      ")
        return lines
    if kind == "function":
        arguments = " ".join(member.findtext("argsstring").split())
        declared = f"{template}{type_} {name}{arguments}".replace("friend ", "").strip()
    elif kind == "typedef":
        declared = f"{template}{name} = {type_}" if "(" not in type_ else f"{template}{name}"
    else:
        initializer = "".join(member.find("initializer").itertext()) if member.find("initializer") is not None else ""
        if "{." in initializer.replace(" ", ""):  # Sphinx does not know designated initialisers
            initializer = ""
        declared = f"{type_} {name}{member.findtext('argsstring') or ''} {' '.join(initializer.split())}".strip()
    return [f"{indent}.. cpp:{kind_of[kind]}:: {declared}", ""] + _text(member, indent + "   ")


def _text(element, indent):
    """Brief and detailed description as paragraphs and lists."""
    blocks = []
    for part in ("briefdescription", "detaileddescription"):
        description = element.find(part)
        for paragraph in description.findall("para") if description is not None else ():
            blocks += _blocks(paragraph)
    lines = []
    for block in blocks:
        lines += [indent + line for line in block] + [""]
    return lines


def _blocks(paragraph):
    blocks, text = [], _escaped(paragraph.text or "")
    for child in paragraph:
        if child.tag in ("itemizedlist", "orderedlist"):
            blocks += [[text]] if text.strip() else []
            blocks.append(["* " + " ".join("".join(item.itertext()).split()) for item in child.findall("listitem")])
            text = ""
        elif child.tag in ("verbatim", "programlisting"):
            blocks += [[text]] if text.strip() else []
            blocks.append(["::", ""] + ["   " + line for line in "".join(child.itertext()).strip("\n").splitlines()])
            text = ""
        elif child.tag == "computeroutput":
            text += f"``{''.join(child.itertext())}``"
        else:
            text += _escaped("".join(child.itertext()))
        text += _escaped(child.tail or "")
    if text.strip():
        blocks.append([" ".join(text.split())])
    return blocks


def _escaped(text):
    """Plain words, whatever marks they have; names in backticks as code."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(f"``{p.strip('`')}``" if p.startswith("`") and len(p) > 2 else re.sub(r"([\\*_|`])", r"\\\1", p) for p in parts)
