#!/usr/bin/python3
"""Checks what cmake/commit.cmake says of a repository, and that it writes only what has changed.
Usage: commit.py REPOSITORY CMAKE FOLDER"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

root, cmake, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
shutil.rmtree(folder, ignore_errors=True)
source, output = folder / "source", folder / "commit.hpp"
source.mkdir(parents=True)


def said():
    """The commit in the header, and when that was written."""
    script = os.path.join(root, "cmake", "commit.cmake")
    subprocess.run([cmake, f"-DSOURCE={source}", f"-DOUTPUT={output}", "-P", script], check=True)
    return re.fullmatch('#define QJULIA_COMMIT "(.*)"\n', output.read_text())[1], output.stat().st_mtime_ns


def git(*words):
    own = ["-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", *own, *words], cwd=source, check=True, capture_output=True, text=True)
    return done.stdout.strip()


def expect(is_right, what):
    if not is_right:
        sys.exit(f"FAILED: {what}")


expect(said()[0] == "", "outside a repository there is no commit")
git("init", "-q")
(source / "a").write_text("1\n")
git("add", "a")
git("commit", "-qm", "first")
git("tag", "-a", "v1", "-m", "a tag is no commit's name")
first = git("rev-parse", "--short=12", "HEAD")
clean = said()
expect(clean[0] == first, f"a clean tree is {first}, not {clean[0]}")
(source / "untracked").write_text("")
expect(said() == clean, "what git does not know is no difference, and the header stays as it was")
(source / "a").write_text("2\n")
expect(said()[0] == first + "-dirty", "a file that differs makes it dirty")
(source / "a").write_text("1\n")
expect(said()[0] == first, "a file that is as it was again does not")
(source / "a").write_text("2\n")
git("commit", "-qam", "second")
second = said()
expect(second[0] == git("rev-parse", "--short=12", "HEAD") != first, "another commit is named")
expect(said() == second, "and the header is not written again")
print("the commit is said as it is")
