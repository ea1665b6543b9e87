"""The add-on for Blender, in Blender without windows, where it is installed.

usage: blender_addon_test.py QJULIA ZIP MAP FOLDER
"""

import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

SKIPPED = 77


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{words}: {done.stderr}")


def in_blender(*words):
    """The script's exit status and what it said."""
    command = ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python",
               str(Path(__file__).with_name("blender_addon.py")), "--", *words]
    # Blender takes the modules of the first Python in PATH; Debian's has NumPy.
    path = os.pathsep.join([os.path.dirname(os.path.realpath(shutil.which("blender"))), os.environ["PATH"]])
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**os.environ, "PATH": path})
    return done.returncode, done.stdout


def prepare(program, map_file, folder):
    """What the command makes, to compare with."""
    def surface(name, *options):
        run(program, "surface", map_file, "-o", str(folder / name), "--resolution", "32", "--up", "z", "--device", "cpu",
            "--quiet", *options)

    surface("detail.ply", "--detail", "0.03")
    # Forty degrees, as a quaternion in front of the map.
    surface("phase.ply", "--detail", "0.03", "--phase", "0.7660444", "0.6427876", "0", "0", "--rotate", "0", "1", "0", "30")
    surface("trap.ply", "--material", "trap", "--palette", "ember")
    run(program, "share", map_file, "-o", str(folder / "page.html"), "--quiet")
    page = (folder / "page.html").read_text()
    (folder / "settings.json").write_text(re.search(r'id="settings">(.*?)</script>', page, re.DOTALL)[1])


def check_versions(program, archive):
    """The add-on's are the program's."""
    version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.split()[1]
    with zipfile.ZipFile(archive) as packed:
        manifest = packed.read("qjulia_maps/blender_manifest.toml").decode()
        module = packed.read("qjulia_maps/__init__.py").decode()
    told = [re.search(r'^version = "(.*)"$', manifest, re.MULTILINE)[1],
            re.search(r'"version": \((.*)\)', module)[1].replace(", ", ".")]
    if told != [version, version]:
        sys.exit(f"blender_addon: qjulia {version} comes with an add-on that calls itself {told}")


def is_running(number):
    return os.path.exists(f"/proc/{number}")


def main():
    program, archive, map_file, folder = sys.argv[1:]
    if not shutil.which("blender"):
        print("SKIPPED: no blender here; 'tools/install-dependencies --all' adds it")
        sys.exit(SKIPPED)
    folder = Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "scripts" / "addons").mkdir(parents=True)
    os.environ["BLENDER_USER_SCRIPTS"] = str(folder / "scripts")
    os.environ["BLENDER_USER_CONFIG"] = str(folder / "config")
    check_versions(program, archive)
    prepare(program, map_file, folder)
    code, said = in_blender(program, archive, map_file, str(folder))
    print(re.sub(r"^Fra:.*\n", "", said, flags=re.MULTILINE))
    if code != 0 or "ALL CHECKED" not in said:
        sys.exit("blender_addon: failed in Blender")
    _, said = in_blender(program, archive, map_file, str(folder), "killed")
    numbers = [int(word) for word in re.search(r"^PROGRAM (.*)$", said, re.MULTILINE)[1].split()]
    until = time.monotonic() + 20
    while any(map(is_running, numbers)) and time.monotonic() < until:
        time.sleep(0.1)
    if len(numbers) != 1 or any(map(is_running, numbers)):
        sys.exit(f"blender_addon: the program outlives Blender, which was killed: {numbers}")
    print("ok      the program ends when Blender is killed")


main()
