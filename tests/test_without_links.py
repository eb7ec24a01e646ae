"""A checkout without symbolic links, as Git makes it where there are none: all that the package brings is found there."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import daebench
from daebench.methods import catalogue
from daebench.reference.keep import form, store
from daebench.systems.files import package as package_files

APART = package_files.APART

PROGRAM = """
import json, sys
from importlib.util import spec_from_file_location
from pathlib import Path

ROOT = Path(sys.argv[1])
FOLDERS = {"daebench": ROOT / "daebench", **{f"daebench.{name}": ROOT / name for name in sys.argv[2:]}}

class Editable:
    "What setuptools installs for a package whose folders stand side by side."

    @staticmethod
    def find_spec(name, path=None, target=None):
        return spec_from_file_location(name, FOLDERS[name] / "__init__.py") if name in FOLDERS else None

sys.meta_path.insert(0, Editable)
import daebench
from daebench.methods import catalogue
from daebench.systems.files import package as package_files
from daebench.reference.keep import form, store
from daebench.pages.report.index import write_index

assert Path(daebench.__file__).is_relative_to(ROOT)
light = "daebench.problems" not in sys.modules and "daebench.reports" not in sys.modules
written = write_index(ROOT / "out", [], {})
print(json.dumps({
    "problems": sorted(catalogue.problems()),
    "defined": catalogue.find_problem("torus").define().fingerprint != "",
    "reports": sorted(catalogue.reports()),
    "lessons": sorted(catalogue.lessons()),
    "references": store.names(form.DATA),
    "files": sorted(package_files.files(".py", ".c", ".html", ".csv")),
    "page": written.read_text(encoding="utf-8").startswith("<!"),
    "light": light,
}))
"""


def test_everything_is_found_in_a_checkout_without_symbolic_links(tmp_path):
    _check_out(tmp_path)
    done = subprocess.run([sys.executable, "-c", PROGRAM, tmp_path, *APART], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == {
        "problems": sorted(catalogue.problems()),
        "defined": True,
        "reports": sorted(catalogue.reports()),
        "lessons": sorted(catalogue.lessons()),
        "references": list(store.names(form.DATA)),
        "files": sorted(package_files.files(".py", ".c", ".html", ".csv")),
        "page": True,
        "light": True,
    }


def _check_out(root):
    """Copy the package; in the place of each link is a file that holds its target."""
    package = Path(daebench.__file__).parent
    shutil.copytree(package, root / "daebench", ignore=_linked_or_compiled)
    for name in APART:
        shutil.copytree(package_files.folder(f"daebench.{name}"), root / name, ignore=_linked_or_compiled)
        (root / "daebench" / name).write_text(f"../{name}", encoding="utf-8")


def _linked_or_compiled(folder, names):
    linked = APART if Path(folder) == Path(daebench.__file__).parent else ()
    return {"__pycache__", *linked} & set(names)
