"""Faults put into a scheme's file or into a kernel, to see them caught."""

import hashlib
import sys

from daebench.compiler import cache, files, link
from daebench.methods import plan


def plant(monkeypatch, tmp_path, file, right, wrong):
    """Have a file read with a fault in it, and keep what it makes apart; modules of this process without the fault serve on."""
    original, execute = link.text_of, cache._execute
    assert original(f"daebench.{file}").count(right) >= 1

    def same_or_new(name, source, path):
        digest = hashlib.sha256(source.encode()).hexdigest()
        generated = [module for key, module in sys.modules.items() if key.startswith(cache.NAME)]
        return next((module for module in generated if module.__digest__ == digest), None) or execute(name, source, path)

    for reader in (link, files):
        monkeypatch.setattr(reader, "text_of", lambda module: original(module).replace(right, wrong if module.endswith(file) else right))
    monkeypatch.setattr(cache, "_execute", same_or_new)
    monkeypatch.setattr(cache, "toolchain", lambda: f"planted {file} {wrong}")
    monkeypatch.setattr(plan, "_plans", {})
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path))
