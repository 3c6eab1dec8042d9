"""The engine: what `segment` loads for a mesh that is given as arrays."""

import json
import subprocess
import sys
from pathlib import Path

CODE = """
import json, sys
import numpy as np
import superfacets

before = set(sys.modules)
vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
superfacets.segment((vertices, np.array([[0, 1, 2], [0, 2, 3]])), 2)
files = {name: getattr(sys.modules[name], "__file__", None) or "" for name in sys.modules}
print(json.dumps([files, sorted(set(sys.modules) - before)]))
"""

LIBRARY_BEYOND_THE_ENGINE = ("regions", "metrics", "files", "tools", "segmentator")


def loaded():
    """Return the files of all modules after a call of `segment`, and the names of new modules."""
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def lines_of(path):
    return len(Path(path).read_text(encoding="utf-8").splitlines())


def test_arrays_load_only_the_engine():
    files, _ = loaded()
    names = [name for name in files if name.split(".")[0].startswith("superfacets")]
    assert not [name for name in names if name.startswith("superfacets_")]
    parts = {name.split(".")[1] for name in names if "." in name}
    assert not parts & set(LIBRARY_BEYOND_THE_ENGINE)
    assert len(names) <= 60
    sources = [files[name] for name in names if files[name].endswith(".py")]
    assert sum(map(lines_of, sources)) <= 11_000


def test_the_engine_loads_no_heavy_modules_of_the_standard_library():
    """NumPy loads some modules itself, before `superfacets` does."""
    _, new = loaded()
    heavy = {"asyncio", "email", "http", "importlib.metadata", "multiprocessing", "xml"}
    assert not heavy & set(new)
