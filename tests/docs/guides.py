#!/usr/bin/python3
"""Runs the commands of the guides, page by page: guides.py REPOSITORY BUILD_FOLDER WORK_FOLDER [PAGE...]

Every block of shell is run, from the page's first to its last, in a folder of the page that has bunny.obj, my.obj (the
same), bunny.qjulia.json and docs. A comment `<!-- run: skip (WHY) -->` above a block leaves it out, and
`<!-- run: file NAME -->` writes the block of TOML above it to that file. So that all pages take minutes, fits end after
seconds and pictures are small; QJULIA_GUIDES=whole runs everything as it is written.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

BLOCK = re.compile(r"((?:<!-- run: [^>]*-->\n)*)```sh\n(.*?)```", re.DOTALL)
MARK = re.compile(r"<!-- run: (skip|file) ?(.*?) -->")
TOML = re.compile(r"```toml\n(.*?)```", re.DOTALL)
# What stands for `qjulia` in a test: smaller work, the same options otherwise.
STAND_IN = '''#!/usr/bin/python3
import os, pathlib, shutil, sys
arguments = sys.argv[1:]
def put(option, value, always=False):
    if option in arguments:
        arguments[arguments.index(option) + 1] = value
    elif always:
        arguments.extend([option, value])
command = arguments[0] if arguments else ""
if command == "fit" and "--help" not in arguments:
    put("--time-limit", "8", True)
    put("--factors", "48", True)
if command == "render":
    put("--size", "96x72", True)
    put("--samples", "1")
if command == "surface":
    put("--resolution", "64", True)
if command == "compare":
    put("--resolution", "32", True)
    put("--size", "64x48")
if command == "shape":
    put("--resolution", "64", True)
if command == "profile" and arguments[1] in ("measure", "against", "tune", "grid"):
    arguments.extend(["--sample-points", "2000", "--factors", "32"])
if command == "film" and arguments[1].endswith(".toml") or arguments[1:2] == ["sheet"]:
    put("--seconds", "0.1", True)
    script = pathlib.Path(next(word for word in arguments if word.endswith(".toml")))
    script.write_text(script.read_text().replace("960x720", "32x24"))
    if not shutil.which("ffmpeg") and "-o" in arguments:
        put("-o", "frames")
os.execv({program!r}, ["qjulia", *arguments])
'''


def page_folder(root, work, page, bunny):
    folder = work / page.stem
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("bunny.obj", "my.obj"):
        shutil.copy(bunny, folder / name)
    shutil.copy(root / "docs/maps/bunny.qjulia.json", folder)
    for name in ("docs", "examples"):
        (folder / name).symlink_to(root / name)
    return folder


def main():
    root, build, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    bunny = pathlib.Path("/usr/share/glmark2/models/bunny.obj")
    if not bunny.exists():
        sys.exit(f"{bunny} is missing: tools/install-dependencies")
    bin_folder = work / "bin"
    bin_folder.mkdir(parents=True, exist_ok=True)
    program = str(build / "qjulia")
    stand_in = bin_folder / "qjulia"
    stand_in.unlink(missing_ok=True)
    if os.environ.get("QJULIA_GUIDES") == "whole":
        stand_in.symlink_to(program)
    else:
        stand_in.write_text(STAND_IN.replace("{program!r}", repr(program)))
        stand_in.chmod(0o755)
    environment = dict(os.environ, PATH=f"{bin_folder}:/usr/bin:/bin", PYTHONPATH=str(build / "python"))
    environment.update(QJULIA_TUNING="off", PYTHONDONTWRITEBYTECODE="1", OMPI_ALLOW_RUN_AS_ROOT="1")
    environment.update(OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", MPLBACKEND="Agg")

    pages = sorted([*(root / "docs/guide").glob("*.md"), *(root / "docs/theory").glob("*.md")])
    if len(sys.argv) > 4:
        pages = [page for page in pages if page.stem in sys.argv[4:]]
    count, failures = 0, []
    for page in pages:
        text_of_page = page.read_text()
        folder = None
        for number, block in enumerate(BLOCK.finditer(text_of_page), 1):
            marks, text = block.groups()
            kinds = MARK.findall(marks)
            if any(kind == "skip" for kind, _ in kinds):
                continue
            folder = folder or page_folder(root, work, page, bunny)
            for _, name in kinds:
                (folder / name).write_text(TOML.findall(text_of_page[:block.start()])[-1])
            command = ["bash", "-c", "set -e\n" + text]
            count += 1
            try:
                run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=900)
                failed, said = run.returncode, run.stdout[-800:] + run.stderr[-1500:]
            except subprocess.TimeoutExpired:
                failed, said = True, "it did not end within 15 minutes"
            print(f"{page.relative_to(root)}, block {number}: {'failed' if failed else 'ran'}", flush=True)
            if failed:
                failures.append(f"{page.relative_to(root)}, block {number}:\n{text}{said}")
    if failures:
        sys.exit("\n".join(failures))
    if not count:
        sys.exit("no block was run")


main()
