"""Prints docs/reference/json.md, the page of what qjulia writes as JSON, from docs/reference/schemas.

usage: schemas.py REPOSITORY

A schema's "title" says what writes such an object, and its "description" says what the object holds. "x-read-by",
which JSON Schema ignores, lists the options that read it.
"""

import json
import pathlib
import sys

BEGINNING = """\
# JSON

With `--json`, a command prints its result as one JSON object; with `--profile FILE.json`, `fit`, `surface` and `render`
write one to a file. Each kind of result has a schema (JSON Schema, draft 2020-12); `system.schemas` checks the results
against them. A result carries no version: its keys keep their meaning ([stability](stability.md)), and a program tells
results apart by the command that it ran, or by the keys that are always there. `cmake --build --preset release --target
reference` makes this page from the schemas.

## Results

| schema | written by | contents | keys that are always there | read by |
|---|---|---|---|---|
"""
END = """
## Files

These files name their format in the key `format`, and all but the checkpoint have a `version`. A file of another format
or of a newer version is refused; in a cache it is not used.

| `format` | `version` | file | written by | read by |
|---|---|---|---|---|
| `qjulia-map` | 1, or 2 where the map needs it | [a map](map-format.md) | `fit`, `batch`, `explore`, `shape`, `paint`, `portals`, `convert` | every command that takes a map |
| `qjulia-shared-tuning` | 1 | settings of a device, for another machine | `profile export` | `profile import` |
| `qjulia-tuning` | 1 | settings of a device, in the cache ([environment](environment.md#files)) | `profile tune`, `profile import` | every command that uses the device |
| `qjulia-program` | 1 | a compiled program, in the cache: one line of JSON, then the binary | every command that uses the device | the same |
| `qjulia-checkpoint` | | the state of a fit, as CBOR after a checksum; it belongs to the program that wrote it | `fit`, `batch run` | `fit --resume`, `batch run --resume` |

A folder of `batch` has `batch.json`, `summary.json` and a `NAME.status.json` for each entry
([batch](../guide/batch.md)). `--trace FILE.json` writes the Trace Event Format, which [Perfetto](https://ui.perfetto.dev)
reads ([speed](../guide/speed.md)).
"""


def always_there(schema):
    """The keys that every object of this schema has, with their value where it is fixed."""
    alternatives = []
    for one in schema.get("oneOf", [schema]):
        fixed = {key: value["const"] for key, value in one["properties"].items() if "const" in value}
        keys = [f'`{key}` "{fixed[key]}"' if key in fixed else f"`{key}`" for key in one.get("required", [])]
        # A value that is fixed tells alternatives apart.
        alternatives.append(", ".join(sorted(keys, key=lambda text: '"' not in text)))
    return "; or ".join(alternatives)


def row(path):
    schema = json.loads(path.read_text())
    readers = ", ".join(f"`{reader}`" for reader in schema.get("x-read-by", []))
    return (
        f"| [{path.name}](schemas/{path.name}) | {schema['title']} | {schema['description']} "
        f"| {always_there(schema)} | {readers} |\n"
    )


def main(root):
    schemas = sorted(pathlib.Path(root, "docs/reference/schemas").glob("*.json"))
    sys.stdout.write(BEGINNING + "".join(row(path) for path in schemas) + END)


main(sys.argv[1])
