"""Several frames of a model in one picture, from left to right, as a flash lamp shows them.

strobe.py MODEL.fil PICTURE.png LEVEL STEP FRAME... [-- RENDER OPTION...]

LEVEL: that is drawn. STEP: metres from one to the next. FRAME: from 1.
"""

import os
import subprocess
import sys
import tempfile


def main(words):
    cut = words.index("--") if "--" in words else len(words)
    (model, picture, level, step, *frames), options = words[:cut], words[cut + 1:]
    with tempfile.TemporaryDirectory() as folder:
        merged, vertices = os.path.join(folder, "all.obj"), 0
        with open(merged, "w") as out:
            for k, frame in enumerate(frames):
                one, count = os.path.join(folder, "one.obj"), 0
                subprocess.run(["filigree", "restore", model, "--frame", frame, "--level", level, "-o", one, "--quiet"], check=True)
                with open(one) as lines:
                    for line in lines:
                        kind, *values = line.split()
                        if kind == "v":
                            out.write(f"v {float(values[0]) + k * float(step)} {values[1]} {values[2]}\n")
                            count += 1
                        elif kind == "f":
                            out.write("f " + " ".join(str(int(v.split("/")[0]) + vertices) for v in values) + "\n")
                vertices += count
        subprocess.run(["filigree", "render", merged, "-o", picture, "--up", "y", *options, "--quiet"], check=True)


main(sys.argv[1:])
