"""Writes the reference of the Python module, which must be installed, with pdoc: `reference.py FOLDER`.

Types of NumPy have their names there, not what they stand for: `ArrayLike` alone is 400 letters.
"""

import sys
import tempfile
from pathlib import Path
from types import GenericAlias

import numpy.typing
import pdoc

# A long type is broken, else a page is wider than its screen.
STYLE = ".pdoc .param, .pdoc .return-annotation { white-space: pre-wrap; overflow-wrap: anywhere; }\n"


class ArrayLike:
    pass


class NDArray:
    __class_getitem__ = classmethod(GenericAlias)


for name in (ArrayLike, NDArray):
    name.__module__ = "numpy.typing"
    setattr(numpy.typing, name.__name__, name)

with tempfile.TemporaryDirectory() as templates:
    Path(templates, "custom.css").write_text(STYLE)
    pdoc.render.configure(docformat="numpy", template_directory=Path(templates))
    pdoc.pdoc("tetdb", output_directory=Path(sys.argv[1]))
