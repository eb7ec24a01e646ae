"""Files of daebench with a field altered and their checksums made anew: what anybody can send."""

import copy
import hashlib
import json
import zipfile

from daebench.cli.endings import FAULT
from daebench.records import seals
from daebench.reference.keep import store

LONGEST = 1100
"""Most characters of a sentence, with those that an ending puts before it."""

CUT = 33
"""Rows of a reference that is cut short."""

NESTED = 300
"""Depth of lists in lists."""

DEEP = "[" * NESTED + "]" * NESTED

ABSURD = {
    "null": "null",
    "true": "true",
    "zero": "0",
    "negative": "-1",
    "fraction": "0.5",
    "huge": "1e300",
    "tiny": "1e-300",
    "huge whole": "9" * 300,
    "whole beyond doubles": "9" * 5000,
    "nan": "NaN",
    "infinite": "1e999",
    "empty text": '""',
    "text": '"x"',
    "long text": json.dumps("x" * 100_000),
    "control characters": json.dumps("\x1b[31m\0\n"),
    "path": '"../../../etc/passwd"',
    "format": '"%s{}{0}"',
    "empty list": "[]",
    "list of null": "[null]",
    "lists": "[[1, [2]], []]",
    "deep": DEEP,
    "empty mapping": "{}",
    "mapping": '{"x": null}',
}
"""Texts of JSON that stand in the place of a value."""


def places_of(value, before=()):
    """Give the places of all values in a nested value, of lists those of the first and the last entry."""
    if before:
        yield before
    keys = list(value) if isinstance(value, dict) else sorted({0, len(value) - 1}) if isinstance(value, list) and value else []
    for key in keys:
        yield from places_of(value[key], (*before, key))


def altered(value, place, text, mark="@absurd@"):
    """Return the text of a nested value with one value replaced by a text of JSON; without it, if that is None."""
    content = copy.deepcopy(value)
    inner = content
    for key in place[:-1]:
        inner = inner[key]
    if text is None:
        del inner[place[-1]]
        return json.dumps(content)
    inner[place[-1]] = mark
    return json.dumps(content).replace(json.dumps(mark), text)


def pack(path, files, manifest):
    """Write an archive of a study with the text of a manifest, in which the digests of its files are made anew if it is JSON."""
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    manifest = manifest.replace('"@files@"', json.dumps(digests))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("manifest.json", manifest)
        for name, content in files.items():
            archive.writestr(name, content)


def unpack(path):
    """Return the manifest of an archive, and its other files."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    return json.loads(files.pop("manifest.json")) | {"files": "@files@"}, files


def require_sentence(status, out, err, what):
    """Require a known status that is no fault, and at most one sentence of limited length."""
    assert status in (0, 1, 2), (what, err)
    assert status != FAULT
    assert "Traceback" not in out + err, what
    assert len(err.splitlines()) <= 1, (what, err)
    assert len(err) <= LONGEST, what
    if status == 2:
        assert out == "", what
        assert err.startswith("daebench: "), (what, err)


def cut_reference(name, folder):
    """Store the first rows of a reference of daebench in a folder, and return that."""
    whole = store.load(name)
    claims = {key: value for key, value in json.loads(json.dumps(whole.certificate)).items() if key not in ("data", "format", "checksum")}
    for part, rows in claims["bound"].items():
        claims["bound"][part] = rows[:CUT] if isinstance(rows, list) else rows
    for which in ("values", "worst", "step"):
        claims["amplification"][which] = claims["amplification"][which][:CUT]
    claims["ida"] = claims["ida"][:2]
    text = {column: cells[:CUT] for column, cells in whole.text.items()}
    claims["horizon"]["truth"] = float(text["t"][-1])
    store.save(name, claims, text, folder)
    return folder / name


def with_checksum(text, data=None):
    """Return the text of a certificate with its checksum, and that of its data, made anew; what JSON cannot have has no checksum."""
    try:
        whole = json.loads(text)
        if data is not None:
            whole["data"]["sha256"] = data
        whole["checksum"] = seals.checksum(whole)
        return json.dumps(whole)
    except (ValueError, TypeError, KeyError, RecursionError):
        return text


def forge_reference(place, certificate=None, digits=None):
    """Rewrite a stored reference: the text of its certificate, its digits, or both; with all checksums that can be made anew."""
    name = place.name
    text = (place / "certificate.json").read_text() if certificate is None else certificate
    content = (place / f"{name}.csv").read_bytes() if digits is None else digits
    (place / f"{name}.csv").write_bytes(content)
    (place / "certificate.json").write_text(with_checksum(text, None if digits is None else hashlib.sha256(content).hexdigest()))
