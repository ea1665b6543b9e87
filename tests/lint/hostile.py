#!/usr/bin/env python3
"""Checks that public functions are called with hostile values: each function and constructor with
parameters that a header of include/qjulia/ROOM declares must be called in tests/conformance/test_hostile_*.cpp
or tests/support/hostile.hpp. Comments and strings are no calls, and a member is called as one of a name
that is declared with its class: `Device& d … d.tuning(…)`, `Rotation{v, x}.matrix()`, `Device::choose(…)`.
Usage: hostile.py REPOSITORY"""

import pathlib
import re
import sys

# Programs that use the library write the first. Only the library calls the next: templates that go through
# members, places of settings, and constructors of what only it makes. The rest take devices, precisions
# and monitors, which cannot be hostile.
EXEMPT = {
    "Ranks::all_gather",
    "SurfaceSink::vertices",
    "SurfaceSink::triangles",
    "Device::Device",
    "Device::is_tuned",
    "Device::with_layout",
    "DeviceError::DeviceError",
    "Example::Example",
    "OptionError::OptionError",
    "Studio::Studio(std",
    "TraceStage::TraceStage",
    "all_gather",
    "driver_facts",
    "first_self_test",
    "quick_self_test",
    "save_tuning",
    "self_test",
}
CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
NAME = r"[A-Za-z_]\w*"


def code_of(text):
    """The text without comments, strings and preprocessor's lines."""
    text = CODE.sub(lambda found: '""' if found[0][0] in "\"'R" else " ", text)
    return re.sub(r"^[ \t]*#[^\n]*(?:\\\n[^\n]*)*", "", text, flags=re.M)


def closing(text, at):
    """Where the bracket at `at` is closed."""
    depth = 0
    for place in range(at, len(text)):
        depth += {"(": 1, "{": 1, "[": 1, ")": -1, "}": -1, "]": -1}.get(text[place], 0)
        if depth == 0:
            return place
    return len(text)


def declared(text, owner=""):
    """Pairs of a class, or "", and the name of a function that takes something."""
    at, begin, is_public = 0, 0, True
    while at < len(text):
        if text[at] == "(":
            at = closing(text, at)
        elif text[at] in ":;{":
            head = text[begin:at].strip()
            if text[at] == ":" and head not in ("public", "private", "protected"):
                at += 1
                continue
            if text[at] == ":":
                is_public = head == "public"
            elif is_public:
                yield from function(head, owner)
            if text[at] == "{":
                end = closing(text, at)
                scope = re.search(rf"\b(namespace|class|struct)\b(?:\s+({NAME}))?[^()=]*$", head)
                if scope and is_public and not head.startswith(("enum", "friend")):
                    body = text[at + 1:end]
                    if scope[1] == "class":
                        body = "private: " + body
                    yield from declared(body, "" if scope[1] == "namespace" else scope[2])
                at = end
            begin = at + 1
        at += 1


def function(head, owner):
    """The pair of a declaration, if it is one of a function that takes something."""
    found = re.match(rf"(?:[^()={{}}]*?[\s&*>])?({NAME})\s*\((.*)\)", head, re.S)
    no_function = r"using|return|friend|template|static_assert|virtual ~|~"
    if not found or re.match(no_function, head) or re.search(r"=\s*(0|delete)\s*$", head):
        return
    name, parameters = found[1], found[2].strip()
    first = parameters.split(")")[0].strip()
    is_copy = name == owner and re.fullmatch(rf"(const )?{owner}\s?&&?\w*", first)
    if first and not is_copy and name != "operator":
        yield owner, name


class Calls:
    """What a file's code calls. Names have the class that the nearest declaration before gives them."""

    def __init__(self, code, types):
        self.code, self.types = code, types

    def has_free(self, name):
        for found in re.finditer(rf"\b{name}\s*\(", self.code):
            before = self.code[:found.start()].rstrip()
            if before.endswith((".", "->")) or (before.endswith("::") and not before.endswith("qjulia::")):
                continue  # a member, or a function of another namespace
            word = re.search(rf"({NAME})$", before)
            if not word or word[1] in ("return", "else", "throw", "case"):
                return True  # and no declaration of this name
        return False

    def has_constructor(self, owner):
        return re.search(rf"\b{owner}(?:\s+{NAME})?\s*[({{]\s*[^\s)}}]", self.code) is not None

    def has_member(self, owner, name):
        if re.search(rf"\b{owner}::{name}\s*\(", self.code):
            return True
        kinds = {owner} | {kind for kind, base in self.types["base"] if base == owner}
        return any(
            kinds & self.classes_before(found.start())
            for found in re.finditer(rf"(?:\.|->)\s*{name}\s*\(", self.code))

    def classes_before(self, end):
        """The classes that the expression which ends there may have."""
        text = self.code[:end].rstrip()
        while text and text[-1] in ")}]":  # a call, a value in place, an index
            text = self.opened(text)
        word = re.search(rf"({NAME})(?:<[\w:, ]*>)?$", text)
        if not word:
            return set()
        name = word[1]
        local = re.findall(rf"\b({NAME})>?[&*\s]*\s(?:const\s)?[&*]?{name}\b", text[:word.start()])
        local = [kind for kind in local if kind in self.types["class"]]
        if local:
            return {local[-1]}
        made = re.findall(rf"\bauto&?\s+{name}\s*=\s*[^;]*?({NAME})\s*\(", text[:word.start()])
        if made:
            return self.types.get(made[-1], set()) | ({made[-1]} & self.types["class"])
        return self.types.get(name, set()) | ({name} & self.types["class"])

    def opened(self, text):
        """The text up to the bracket that its last one closes."""
        depth = 0
        for place in range(len(text) - 1, -1, -1):
            depth += {")": 1, "}": 1, "]": 1, "(": -1, "{": -1, "[": -1}.get(text[place], 0)
            if depth == 0:
                return text[:place].rstrip()
        return ""


def types_of(sources, classes, bases):
    """The classes that names of functions, members and parameters are declared with."""
    types = {"class": classes, "base": bases}
    for code in sources:
        for kind, name in re.findall(rf"\b({NAME})>?[&*\s]*\s(?:const\s)?[&*]?({NAME})\b", code):
            if kind in classes:
                types.setdefault(name, set()).add(kind)
    return types


def main():
    root = pathlib.Path(sys.argv[1])
    headers = sorted((root / "include/qjulia").rglob("*.hpp"))
    code = {header: code_of(header.read_text()) for header in headers}
    tests = sorted((root / "tests/conformance").glob("test_hostile_*.cpp")) + [root / "tests/support/hostile.hpp"]
    test = "\n".join(code_of(file.read_text()) for file in tests)
    bases = re.findall(rf"\b(?:class|struct)\s+({NAME})\s*:\s*(?:public\s+)?({NAME})", "\n".join(code.values()))
    # A table's rows are settings, through one more class.
    bases += [(kind, "Setting") for kind, base in bases if base == "SettingOf"]
    classes = set(re.findall(rf"\b(?:class|struct)\s+({NAME})", "\n".join(code.values())))
    calls = Calls(test, types_of([*code.values(), test], classes, bases))
    missing, count = [], 0
    for header in headers:
        for owner, name in sorted(set(declared(code[header]))):
            whole = f"{owner}::{name}" if owner else name
            if whole in EXEMPT:
                continue
            count += 1
            if not owner:
                is_called = calls.has_free(name)
            elif name == owner:
                is_called = calls.has_constructor(owner)
            else:
                is_called = calls.has_member(owner, name)
            if not is_called:
                missing.append(f"{header.name}: {whole}")
    if missing:
        print("\n".join(missing))
        sys.exit("^ call these with hostile values in tests/conformance/test_hostile_*.cpp")
    print(f"{count} functions of {len(headers)} public headers are all called")


if __name__ == "__main__":
    main()
