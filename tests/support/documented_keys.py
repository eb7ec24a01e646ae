"""What a command printed, held against the keys that the page on JSON documents."""

ITEMS = {"numbers": "number", "integers": "integer", "strings": "string", "objects": "object", "lists": "list", "booleans": "boolean"}
"""Types of the entries of lists."""


def disagreements(printed, documented):
    """Return in which keys, and types of values, something printed is not as documented."""
    return _below(printed, _tree(documented), "")


def _tree(keys):
    """Return keys as a tree: a node has its key, and those below it by name."""
    top = {"key": None, "below": {}}
    for key in keys:
        node = top
        for name in key.path.replace("[]", ".[]").strip(".").split("."):
            node = node["below"].setdefault(name, {"key": None, "below": {}})
        node["key"] = key
    return top


def _below(value, node, path):
    wrong = []
    if node["key"] is not None and not any(_is(value, name) for name in node["key"].types):
        wrong.append(f"{path}: {str(value)[:60]!r} is no {' or '.join(node['key'].types)}")
    below = node["below"]
    if isinstance(value, list) and "[]" in below:
        return wrong + [text for entry in value for text in _below(entry, below["[]"], f"{path}[]")]
    if not isinstance(value, dict) or not below:
        return wrong
    if "*" in below:
        return wrong + [text for name, entry in value.items() for text in _below(entry, below["*"], f"{path}.{name}")]
    needed = {name for name, inner in below.items() if inner["key"] is None or not inner["key"].optional}
    wrong += [f"{path}.{name} is not documented" for name in value if name not in below]
    wrong += [f"{path}.{name} is not printed" for name in sorted(needed - set(value))]
    return wrong + [text for name, entry in value.items() if name in below for text in _below(entry, below[name], f"{path}.{name}")]


def _is(value, name):
    """Return whether a value is of a documented type."""
    if name.startswith("list of "):
        return isinstance(value, list) and all(_is(entry, ITEMS[name.removeprefix("list of ")]) for entry in value)
    if name.startswith("object of "):
        return isinstance(value, dict) and all(_is(entry, ITEMS[name.removeprefix("object of ")]) for entry in value.values())
    if isinstance(value, bool) or name == "boolean":
        return isinstance(value, bool) and name == "boolean"
    types = {"string": str, "number": (int, float), "integer": int, "object": dict, "list": list, "null": type(None)}
    return isinstance(value, types[name])
