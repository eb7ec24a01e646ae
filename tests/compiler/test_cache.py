"""The cache of generated modules and machine code: what is damaged or another's is made anew, and the numbers are always right."""

import json
import os
import stat
import subprocess
import sys
import types
from pathlib import Path

import cache_damage
import planting
import pytest
from recorded import compiled

import daebench
from daebench.compiler import cache, sealed
from daebench.compiler.cache import generated
from daebench.compiler.sealed import CacheWarning
from daebench.systems.files.package import digest_of_packages

PROGRAM = """
import json, shutil, sys
from pathlib import Path
from cache_damage import FAMILY, folder, swapped
from daebench.compiler.cache import generated, written

TEXT = "def root(x):\\n    return x * x + {} * x\\n"

def values():
    for name in [each for each in sys.modules if each.startswith("daebench_generated_small")]:
        del sys.modules[name]
    modules = [generated("small", str(k), lambda k=k: written("Small.", ("root",), [TEXT.format(k)])) for k in (1, 2)]
    return [module.root(2.0) for module in modules]

kept, pristine = Path(sys.argv[1]), Path(sys.argv[2])
print(json.dumps(["as made", values()]))
shutil.copytree(kept, pristine)
files = [each.relative_to(kept) for each in sorted(kept.rglob("*")) if each.is_file()]
one_a_kind = list({each.suffix: each for each in files}.values())
WHOLE = {"a folder": lambda path: folder(path), "another's": lambda path: swapped(path, list(pristine.rglob("*")))}
for file in one_a_kind:
    for what in (*FAMILY, *WHOLE):
        shutil.rmtree(kept)
        shutil.copytree(pristine, kept)
        if what in FAMILY:
            (kept / file).write_bytes(FAMILY[what]((pristine / file).read_bytes()))
        else:
            WHOLE[what](kept / file)
        print(json.dumps([f"{file.suffix} {what}", values()]), flush=True)
"""


def in_a_process(program, *words, **environment):
    where = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[1] / "support"), *sys.path])}
    run = [sys.executable, "-c", program, *map(str, words)]
    return subprocess.run(run, env=os.environ | where | environment, capture_output=True, text=True)


GENERATORS = ("compiler", "joints", "methods", "runs", "schemes", "systems")
"""Folders of the package whose files decide what generated source says."""


def test_an_edit_of_any_file_that_decides_generated_source_changes_the_key(monkeypatch):
    monkeypatch.setattr(cache, "digest_of_packages", digest_of_packages.__wrapped__)
    package, before, read = Path(daebench.__file__).parent, cache.toolchain.__wrapped__(), Path.read_bytes
    files = [file for folder in GENERATORS for file in sorted((package / folder).rglob("*.py"))]
    overlooked = []
    for edited in planting.drawn(files, planting.digest(), 30):
        monkeypatch.setattr(Path, "read_bytes", lambda path, edited=edited: read(path) + b"#" * (path == edited))
        if cache.toolchain.__wrapped__() == before:
            overlooked.append(edited.relative_to(package).as_posix())
    assert "poisson_residuals" in {file.stem for file in files}
    assert overlooked == []


def test_damaged_files_are_made_anew_and_the_numbers_are_right(tmp_path):
    done = in_a_process(PROGRAM, tmp_path / "kept", tmp_path / "pristine", DAEBENCH_CACHE=str(tmp_path / "kept"))
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert (done.returncode, done.stderr) == (0, ""), told[-1:]
    assert [what for what, values in told if values != [6.0, 8.0]] == []
    assert len(told) >= 2 * (len(cache_damage.FAMILY) + 2) + 1


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """An empty cache directory, open to others as one that an older version made."""
    folder = tmp_path / "kept"
    folder.mkdir()
    folder.chmod(0o777)
    monkeypatch.setenv("DAEBENCH_CACHE", str(folder))
    sealed.warn.cache_clear()
    return folder


def asked(key):
    """Return whether a generated module has a file, and forget the module."""
    module = generated("plain", key, lambda: f"VALUE = {key!r}")
    sys.modules.pop(module.__name__)
    assert isinstance(module, types.ModuleType)
    assert key == module.VALUE
    return module.__file__ != module.__name__


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


posix = pytest.mark.skipif(os.name == "nt", reason="Windows has no such rights")


@posix
def test_the_folder_is_made_for_its_user_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path / "a" / "b"))
    assert asked("made") is True
    assert mode(tmp_path / "a" / "b") == 0o700


@posix
def test_an_own_folder_that_is_open_to_others_is_closed(kept):
    (kept / "daebench_generated_old.py").write_text("")
    assert asked("mended") is True
    assert mode(kept) == 0o700


@posix
@pytest.mark.parametrize(("rights", "trusted"), [(0o777, False), (0o775, False), (0o755, True), (0o700, True)])
def test_a_folder_of_other_things_keeps_its_rights_and_is_trusted_where_others_cannot_write(kept, rights, trusted):
    (kept / "thesis.tex").write_text("")
    kept.chmod(rights)
    if trusted:
        assert asked("shared") is True
    else:
        with pytest.warns(
            CacheWarning, match=r"can be written to by other users, who could change the code that is run; compiling in memory"
        ):
            assert asked("shared") is False
    assert mode(kept) == rights


@posix
def test_a_folder_of_another_user_is_not_used(kept, monkeypatch):
    another = os.geteuid() + 1
    monkeypatch.setattr(sealed.os, "geteuid", lambda: another)
    with pytest.warns(CacheWarning, match=r"belongs to another user, who could change the code that is run; compiling in memory"):
        assert asked("foreign") is False
    assert list(kept.iterdir()) == []


@posix
def test_a_file_of_another_user_is_not_read(kept, monkeypatch):
    asked("once")
    (path,) = kept.iterdir()
    with monkeypatch.context() as patch:
        patch.setattr(sealed, "_is_ours", lambda status: stat.S_ISDIR(status.st_mode))
        assert sealed.owned_bytes(path) is None
    assert sealed.owned_bytes(path) is not None


@pytest.mark.parametrize("stopped", [KeyboardInterrupt, OSError(28, "No space left on device")], ids=["interrupted", "disk full"])
def test_a_write_that_is_stopped_leaves_nothing(kept, monkeypatch, stopped):
    def stop(self, target):
        raise stopped

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", stop)
        if stopped is KeyboardInterrupt:
            with pytest.raises(KeyboardInterrupt):
                asked("stopped")
        else:
            with pytest.warns(CacheWarning, match="cannot write to the cache directory"):
                assert asked("stopped") is False
    assert list(kept.iterdir()) == []
    assert asked("stopped") is True


def test_machine_code_that_cannot_be_written_is_said_once_and_the_run_goes_on(kept, monkeypatch):
    root = compiled("def root(x):\n    return x * x\n")

    def full(path, purpose, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sealed, "write", full)
    with pytest.warns(CacheWarning, match=r"cannot store machine code in .* \(No space left on device\)") as said:
        assert (root(3.0), root(3j)) == (9.0, -9)
    assert len(said) == 1


def test_the_source_of_another_module_is_not_run_under_this_name(kept):
    asked("one")
    asked("two")
    one, two = sorted(kept.iterdir())
    content = cache._read(one)
    two.write_bytes(one.read_bytes())
    assert cache._read(two) == ""
    assert not two.exists()
    assert cache._read(one) == content != ""
