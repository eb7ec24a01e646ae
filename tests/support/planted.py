"""Faults put into a scheme's file or into a kernel, to see them caught."""

from daebench.compiler import link


def plant(monkeypatch, tmp_path, file, right, wrong):
    """Have the linker read a file with a fault in it, and keep what it makes apart."""
    original = link.text_of
    assert original(f"daebench.{file}").count(right) >= 1
    monkeypatch.setattr(link, "text_of", lambda module: original(module).replace(right, wrong if module.endswith(file) else right))
    monkeypatch.setattr("daebench.compiler.cache.toolchain", lambda: f"planted {file} {wrong}")
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path))
