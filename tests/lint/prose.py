#!/usr/bin/python3
"""What pages refer to: prose.py REPOSITORY

Links lead to files and headings that exist, every page is in its folder's index, every shown picture is made by a
command on some page or by a script (or has a comment `<!-- picture: WHY -->`), and every command on a page has options
that exist. Pages of the laboratory say whether they are history or which script makes them. The version is the same
everywhere.
"""
import pathlib
import re
import sys

LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s#]*)(?:#([^)\s]*))?\)")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]+")


def without_code(text):
    return re.sub(r"```.*?```", lambda block: "\n" * block[0].count("\n"), text, flags=re.DOTALL)


def slug(heading):
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip()).replace("`", "").replace("*", "")
    return re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")


def headings(text):
    return {slug(line.lstrip("#")) for line in without_code(text).split("\n") if line.startswith("#")}


def broken(root, page, text, places):
    name = page.relative_to(root)
    for _, target, place in LINK.findall(without_code(text)):
        if "://" in target or target.startswith("mailto:"):
            continue
        aim = (page.parent / target).resolve() if target else page
        if not aim.exists():
            yield f"{name}: {target} does not exist"
        elif place and aim in places and place not in places[aim]:
            yield f"{name}: {target} has no heading #{place}"


def unlisted(root):
    for folder in ("guide", "theory", "reference", "lab", "decisions"):
        index = (root / "docs" / folder / "README.md").read_text()
        for page in (root / "docs" / folder).glob("*.md"):
            if page.name != "README.md" and f"]({page.name})" not in index:
                yield f"docs/{folder}/README.md does not list {page.name}"


def unmade(root, pages):
    commands = "\n".join(pages.values())
    for script in ("tools/dev/gallery", "tools/explore/screenshots", "tools/blender/screenshot"):
        if (root / script).exists():
            commands += (root / script).read_text()
    commands = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", commands)  # what shows a picture does not make it
    for page, text in pages.items():
        if "/lab/" in str(page):
            continue
        for picture, target, _ in LINK.findall(re.sub(r"<!-- picture: [^>]*-->\n.*", "", text)):
            stem = pathlib.PurePath(target).stem
            if (page.parent / target).with_suffix(".toml").exists():
                continue  # its job lies beside it
            numbered = re.escape(stem.rstrip("0123456789")) + (r"(?:\d|\$i)" if stem[-1:].isdigit() else "")
            if picture and not re.search(rf"(?<!\w)(?:{numbered}\.png|(?:draw|sheet) {numbered}\b)", commands):
                yield f"{page.relative_to(root)}: no command on a page makes {stem}.png"


def unknown_options(name, text, known):
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) + re.findall(r"`(qjulia [^`]*)`", text):
        for line in block.replace("\\\n", " ").split("\n"):
            # From the command to the end of what it is given.
            for call in re.findall(r"(?:^|[\s/])qjulia ((?:[a-z]+)[^;&|#]*)", line):
                words = call.split()
                command = next((name for name in (" ".join(words[:2]), words[0]) if name in known), "")
                for option in OPTION.findall(call):
                    if command in known and option not in known[command]:
                        yield f"{name}: 'qjulia {command}' has no {option}"


def other_versions(root):
    version = re.search(r"project\(qjulia VERSION (\S+)", (root / "CMakeLists.txt").read_text())[1]
    for name, pattern in (
        ("CITATION.cff", r"(?m)^version: (\S+)"),
        ("tools/blender/qjulia_maps/blender_manifest.toml", r'(?m)^version = "(\S+)"'),
        ("tools/blender/qjulia_maps/__init__.py", r'"version": \(([\d, ]+)\)'),
        ("CHANGELOG.md", r"(?m)^## \[(\d\S*)\]"),
    ):
        found = re.search(pattern, (root / name).read_text())
        if not found or found[1].replace(", ", ".") != version:
            yield f"{name} has the version {found[1] if found else 'none'}, CMakeLists.txt {version}"


def options_of(reference):
    known = {}
    for section in re.split(r"(?m)^## ", reference)[1:]:
        title = section.split("\n")[0]
        if title.startswith("qjulia "):
            known[title.removeprefix("qjulia ")] = set(OPTION.findall(section))
    for group, usual in re.findall(r"'qjulia (\w+)' is 'qjulia (\w+ \w+)'", reference):
        known[group] |= known[usual]
    return known


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    files = [root / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    files += sorted((root / "docs").rglob("*.md"))
    pages = {file: file.read_text() for file in files}
    places = {file: headings(text) for file, text in pages.items()}
    known = options_of(pages[root / "docs/reference/command-line.md"])
    problems = [*other_versions(root), *unlisted(root), *unmade(root, pages)]
    for file, text in pages.items():
        name = str(file.relative_to(root))
        problems += broken(root, file, text, places)
        problems += unknown_options(name, text, known)
        if name.startswith("docs/lab/") and not re.search(r"> History\.|tools/", text):
            problems.append(f"{name} says neither that it is history nor which script makes it")
    if len(known) < 10:
        problems.append("docs/reference/command-line.md has no commands")
    for problem in problems:
        print(problem)
    sys.exit(bool(problems))


main()
