#!/usr/bin/env python3
"""Checks that public functions are called with hostile values: each function with parameters that a
header of include/qjulia declares must be named in tests/conformance/test_hostile_values.cpp.
Usage: hostile.py REPOSITORY"""

import pathlib
import re
import sys

# Programs that use the library write the first. Only the library calls the two templates after it.
# The rest take devices and precisions, which cannot be hostile.
EXEMPT = {"all_gather", "members", "visit", "is_tuned", "save_tuning", "self_test", "quick_self_test",
          "first_self_test", "self_test_plan", "with_layout", "opencl_context", "opencl_device",
          "opencl_queue", "driver_facts"}


def declared(text):
    """Names of functions that take something: a type before the name, and a parameter after it."""
    text = re.sub(r'//[^\n]*|^\s*#.*$|"[^"\n]*"', "", text, flags=re.M)
    text = re.sub(r"\b(return|throw|if|while|for|case)\b[^;{]*", "", text)
    return set(re.findall(r"[\w>&*]\s+[&*]?([a-z]\w*[a-z0-9])\((?!\))", text))


def main():
    root = pathlib.Path(sys.argv[1])
    test = (root / "tests/conformance/test_hostile_values.cpp").read_text()
    called = set(re.findall(r"[a-z_][a-z_0-9]*", test))
    headers = sorted((root / "include/qjulia").glob("*.hpp"))
    missing = [
        f"{header.name}: {name}"
        for header in headers
        for name in sorted(declared(header.read_text()) - called - EXEMPT)
    ]
    if missing:
        print("\n".join(missing))
        sys.exit("^ call these with hostile values in tests/conformance/test_hostile_values.cpp")
    print(f"no function of {len(headers)} public headers is left out")


if __name__ == "__main__":
    main()
