"""Keyword arguments that come from the library's tables of settings."""

from __future__ import annotations

import inspect
import re
import textwrap


def _kind(row):
    """The type of a setting's values, as numpydoc writes it."""
    kind, values = row["type"], row["values"]
    if "ArrayLike" in kind:
        return f"array, {values}"
    if "Tuple" in kind:
        return "(int, int)"
    if "Mapping" in kind:
        return "str or dict"
    if "_Detail" in kind:
        return 'float or {"auto", "smooth", "clear", "wild"}'
    if "Sequence" in kind:
        return "str or sequence of str"
    if kind.startswith("Literal") or "_Up" in kind:
        return "{" + ", ".join(f'"{word}"' for word in values.split("|")) + "}"
    name = "int" if "SupportsIndex" in kind else re.search("float|str|bool", kind).group()
    return name + (' or "auto"' if '"auto"' in kind else "")


def _parameter(row, names):
    """A setting as one of numpydoc's parameters. Its help names others as the library does."""
    usual = "optional" if row["default"] is None else f"default {row['default']!r}"
    parts = [_kind(row), row["unit"], usual]
    text = f"{row['help']}."
    if row["range"] and row["range"] not in text:
        text += f" {row['range'][:1].upper()}{row['range'][1:]}."
    text = re.sub("`([a-z_]+)`", lambda found: f"`{names[found.group(1)]}`", f"{text} {row['more']}")
    body = textwrap.fill(text.strip(), 96, initial_indent="    ", subsequent_indent="    ")
    return f"{row['name']} : {', '.join(part for part in parts if part)}\n{body}"


def with_settings(rows, all_of_them=False):
    """A decorator for a function that hands its keywords to the core.

    The settings take the place of the line ``settings`` in its documentation. In its signature they stand before
    ``**options``, which is left out where they are all that it takes.
    """
    names = {row["field"]: row["name"] for row in rows}

    def decorate(function):
        if function.__doc__ is not None:  # python -OO has none
            text = inspect.cleandoc(function.__doc__)
            described = "\n".join(_parameter(row, names) for row in rows)
            head, found, tail = text.partition("\nsettings\n")
            assert found, function
            function.__doc__ = f"{head}\n{described}\n{tail}"
        signature = inspect.signature(function)
        own = list(signature.parameters.values())
        rest = own.pop()
        assert rest.kind is rest.VAR_KEYWORD, function
        named = {parameter.name for parameter in own}
        own += [
            inspect.Parameter(row["name"], inspect.Parameter.KEYWORD_ONLY, default=row["default"])
            for row in rows
            if row["name"] not in named
        ]
        function.__signature__ = signature.replace(parameters=own if all_of_them else [*own, rest])
        return function

    return decorate
