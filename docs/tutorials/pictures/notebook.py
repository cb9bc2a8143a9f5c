"""Makes dragon.ipynb of docs/tutorials/notebook.md, in the current folder: its text, its cells, and what they print and draw.

notebook.py               runs all cells; also writes cell_2.png and so on: the plot of each cell that draws one
notebook.py look          picture notebook_2.png: the beginning of dragon.ipynb in a browser (needs jupyter nbconvert and Chromium)
"""

import base64
import contextlib
import io
import json
import pathlib
import re
import subprocess
import sys

PAGE = pathlib.Path(__file__).parent.parent / "notebook.md"


def parts(page):
    """Text and code in turn. What is left out: the set-up, commands of the shell, output, and pictures."""
    begin = page.index("## 1.")
    for text, code in re.findall(r"(.*?)^```python\n(.*?)^```$", page[begin:], re.S | re.M):
        text = re.sub(r"^```(sh|text)\n.*?^```$|<!--.*?-->|^!\[.*?\]\(.*?\)$", "", text, flags=re.S | re.M)
        yield re.sub(r"\n{3,}", "\n\n", text).strip(), code.strip()


def run(code, names, picture):
    """What a cell prints, and the plot that it leaves."""
    import matplotlib.pyplot as plt

    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code, names)
    outputs = []
    if printed.getvalue():
        print(printed.getvalue(), end="")
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    if plt.get_fignums():
        plt.savefig(picture, dpi=120)
        plt.close("all")
        image = base64.b64encode(pathlib.Path(picture).read_bytes()).decode()
        outputs.append({"output_type": "display_data", "metadata": {}, "data": {"image/png": image}})
    return outputs


def make():
    sys.path.append(str(PAGE.parents[2] / "build/release/python"))
    import matplotlib

    matplotlib.use("Agg")
    cells, names = [], {"__name__": "__main__"}
    for k, (text, code) in enumerate(parts(PAGE.read_text()), 1):
        if text:
            cells.append({"cell_type": "markdown", "metadata": {}, "source": text})
        outputs = run(code, names, f"cell_{k}.png")
        cells.append({"cell_type": "code", "execution_count": k, "metadata": {}, "source": code, "outputs": outputs})
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    notebook = {"nbformat": 4, "nbformat_minor": 4, "metadata": kernel, "cells": cells}
    pathlib.Path("dragon.ipynb").write_text(json.dumps(notebook, indent=1))
    print("dragon.ipynb")


def look():
    subprocess.run(["jupyter", "nbconvert", "--to", "html", "--log-level", "ERROR", "--HTMLExporter.mathjax_url=", "dragon.ipynb"], check=True)
    page = pathlib.Path("dragon.html").absolute().as_uri()
    options = ["--no-sandbox", "--hide-scrollbars", "--disable-gpu", "--window-size=960,850", "--screenshot=notebook_2.png"]
    subprocess.run(["chromium-headless-shell", *options, page], check=True, stderr=subprocess.DEVNULL)


look() if sys.argv[1:] == ["look"] else make()
