"""The Python module `filigree`: the one in the add-on's own folder, else the one that is installed."""

import os
import sys

_OWN = os.path.join(os.path.dirname(__file__), "lib")
if os.path.isdir(_OWN) and _OWN not in sys.path:
    sys.path.insert(0, _OWN)

try:
    import filigree
    missing = ""
except ImportError as error:  # the panel says so; Blender starts all the same
    filigree = None
    missing = f"The Python module filigree cannot be loaded: {error}"
