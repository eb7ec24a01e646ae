"""The page of all public names, which is kept in the repository, and the selection of names that the reference has."""

import inspect

from said import DOCS

import daebench


def test_the_page_of_names_is_that_of_the_docstrings():
    from daebench_site import names

    # python docs/daebench_site/names.py writes it again.
    assert (DOCS / "reference" / "names.md").read_text(encoding="utf-8") == names.page()


def test_each_function_of_the_reference_has_an_example():
    from daebench_site.api import chapter_names, kind, resolve
    from daebench_site.contents import TASKS
    from daebench_site.names import LANGUAGE

    listed = [name for task in TASKS if task.key != LANGUAGE for name in chapter_names(task.key) if kind(name) == "autofunction"]
    assert len(listed) > 70
    assert [name for name in listed if ">>> " not in inspect.getdoc(resolve(name))] == []


def test_dir_has_public_names_only():
    for name in daebench.__all__:
        getattr(daebench, name)  # what has been imported would be among the attributes of the module
    assert set(dir(daebench)) == set(daebench.__all__)
    assert not [name for name in dir(daebench) if name.startswith("_")]
