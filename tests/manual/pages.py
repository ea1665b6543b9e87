"""Manual pages: no reader of them warns, and each says all that --help-all does.

usage: pages.py COMMAND FOLDER
"""
import os
import pathlib
import re
import subprocess
import sys

SECTIONS = ["NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "ENVIRONMENT", "EXIT STATUS", "FILES", "SEE ALSO"]


def output(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    return done.returncode, done.stdout, done.stderr


def warnings(page):
    """What readers of manual pages find wrong with this one."""
    found = []
    for command in (["man", "--warnings", "-l"], ["groff", "-man", "-ww", "-z"], ["mandoc", "-Tlint", "-Wwarning"]):
        code, out, err = output(*command, str(page), env={**os.environ, "MANWIDTH": "100", "LC_ALL": "C.UTF-8"})
        said = err if command[0] == "man" else out + err
        if code != 0 or said:
            found.append(f"{page.name}: {' '.join(command)}: {said or code}")
    return found


def text_of(page):
    _, out, _ = output("mandoc", "-Tascii", "-Owidth=1000", str(page))
    return re.sub(".\b", "", out)


def options_in_help(command, *words):
    _, out, _ = output(command, *words)
    columns = re.findall(r"^  ((?:-\w,)?--[a-z-]+)", out, re.MULTILINE)
    return [name for column in columns for name in column.split(",")]


def problems_of(page, options):
    problems = warnings(page)
    text = text_of(page)
    problems += [f"{page.name}: no section {name}" for name in SECTIONS if f"\n{name}\n" not in text]
    tags = re.findall(r"^ +((?:-\w, )?--[a-z-]+)", text, re.MULTILINE)
    described = {name for tag in tags for name in tag.split(", ")}
    problems += [f"{page.name}: {option} is not described" for option in options if option not in described]
    return problems


def main(command, folder):
    folder = pathlib.Path(folder)
    code, help_text, _ = output(command, "--help")
    names = re.findall(r"^  ([a-z]+) {2,}", help_text.split("Subcommands:")[1], re.MULTILINE)
    assert code == 0 and len(names) >= 16, help_text
    problems = problems_of(folder / "qjulia.1", ["-h", "--help", "--version"])
    checked = 0
    for group in names[:]:
        code, help_text, _ = output(command, group, "--help")
        _, _, members = help_text.partition("Subcommands:")
        names += [f"{group} {name}" for name in re.findall(r"^  ([a-z]+) {2,}", members, re.MULTILINE)]
    groups = {name.split()[0] for name in names if " " in name}
    assert len(groups) >= 3, names
    for name in names:
        if name in groups:
            problems += problems_of(folder / f"qjulia-{name}.1", ["-h", "--help", "--help-all"])
            continue
        options = options_in_help(command, *name.split(), "--help-all")
        assert len(options) >= 5, f"{name}: {options}"
        checked += len(options)
        problems += problems_of(folder / f"qjulia-{name.replace(' ', '-')}.1", options)
    pages = {page.name for page in folder.glob("*.1")}
    problems += [f"{name}: a page of no command" for name in pages - {"qjulia.1"} - {f"qjulia-{n.replace(' ', '-')}.1" for n in names}]
    print("\n".join(problems) or f"{len(pages)} pages, {checked} options, nothing wrong")
    return 1 if problems else 0


sys.exit(main(*sys.argv[1:]))
