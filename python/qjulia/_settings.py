"""Keyword arguments that come from the library's tables of settings."""

from __future__ import annotations

import inspect
import textwrap


def _parameter(row):
    """A setting as one of numpydoc's parameters."""
    usual = "optional" if row["default"] is None else f"default {row['default']!r}"
    parts = [row["values"] or "bool", row["unit"], usual]
    text = f"{row['help']}."
    if row["range"] and row["range"] not in text:
        text += f" {row['range'][:1].upper()}{row['range'][1:]}."
    body = textwrap.fill(
        f"{text} {row['more']}".strip(), 96, initial_indent="    ", subsequent_indent="    "
    )
    return f"{row['name']} : {', '.join(part for part in parts if part)}\n{body}"


def with_settings(rows, all_of_them=False):
    """A decorator for a function that hands its keywords to the core.

    The settings take the place of the line ``settings`` in its documentation, and that of ``**options`` in its
    signature, which stays after them unless they are all.
    """

    def decorate(function):
        text = inspect.cleandoc(function.__doc__)
        described = "\n".join(map(_parameter, rows))
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
