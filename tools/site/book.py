"""Writes the guide as sources of an mdBook: `book.py PROGRAM API FOLDER [python]`.

PROGRAM is `tetdb`, whose help becomes a chapter. API is the folder of `cargo doc`, in which links to items are looked up; in the site
it is `api`. `python` adds a link to the reference of the Python module, in the folder `python` of the site. The texts are those of the
repository, and their order is that of the table in `src/guide/mod.rs`. Only links change.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "src/guide"
PACKAGE = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
# Pages outside of the guide, by the names they get.
OTHERS = {"schema/README.md": "store-format.md", "benches/README.md": "measurements.md", "CHANGELOG.md": "changelog.md", "SECURITY.md": "security.md"}

BOOK = """[book]
title = "tetdb"
description = "Tetrahedral meshes larger than memory"
authors = ["The tetdb contributors"]
language = "en"
src = "src"

[output.html]
git-repository-url = "{repository}"
additional-css = ["site.css"]
no-section-label = true
default-theme = "light"

[output.html.search]
limit-results = 20
use-boolean-and = true

# The playground does not have the crate.
[output.html.playground]
runnable = false

[output.html.print]
enable = false
"""


def chapters() -> list[str]:
    """Names of the guide's chapters in reading order."""
    found = re.findall(r"^//! \| \[`(\w+)`\]", (GUIDE / "mod.rs").read_text(), re.MULTILINE)
    files = {path.stem for path in GUIDE.glob("*.md")}
    if set(found) != files:
        sys.exit(f"src/guide/mod.rs and the files of src/guide differ in {sorted(set(found) ^ files)}")
    return found


def items(api: Path) -> dict[str, str]:
    """Pages of `cargo doc` for the items that the guide links, by the words of the link."""
    found = {}
    for words, path in re.findall(r'"\[`([\w:]+)`\]: crate::([\w:]+)\\n"', (GUIDE / "mod.rs").read_text()):
        owner, _, member = words.partition("::")
        pages = sorted(api.glob(f"tetdb*/**/*.{owner}.html"), key=lambda page: (len(page.parts), page))
        if not pages:
            sys.exit(f"{api} has no page of {path}")
        page = pages[0].relative_to(api).as_posix()
        anchors = re.findall(rf'id="((?:variant|method)\.{member})"', pages[0].read_text()) if member else []
        found[f"`{words}`"] = f"api/{page}" + (f"#{anchors[0]}" if anchors else "")
    return found


def option(found: re.Match[str]) -> str:
    """An option in one piece: a browser breaks lines behind hyphens, also behind the first. As `--`, two hyphens would become a dash."""
    return f'<code class="option">{found[1].replace("-", "&#45;")}</code>'


class Links:
    """Where links of a page lead in the site."""

    def __init__(self, api: Path) -> None:
        self.items = items(api)
        self.pages = {GUIDE / f"{name}.md": f"{name}.md" for name in chapters()}
        self.pages |= {ROOT / path: name for path, name in OTHERS.items()}
        self.pages[ROOT / "README.md"] = "index.md"

    def leads(self, page: Path, target: str) -> str:
        path, mark, anchor = target.partition("#")
        if not path or "://" in target:
            return target
        there = Path(os.path.normpath(page.parent / path))
        if there in self.pages:
            return self.pages[there] + mark + anchor
        if there.is_relative_to(GUIDE / "pictures"):
            return f"pictures/{there.name}"
        return f"{PACKAGE['repository']}/blob/main/{there.relative_to(ROOT).as_posix()}"

    def rewritten(self, page: Path) -> str:
        """The text of a page with the links of the site, and with `rust` at blocks of Rust, which rustdoc needs no word for."""
        lines, inside = [], False
        for line in page.read_text().splitlines():
            if line.startswith("```"):
                if line == "```" and not inside and page.parent == GUIDE:
                    line = "```rust"
                inside = not inside
            elif not inside:
                line = re.sub(r"(?<=\]\()([^)\s]+)(?=\))", lambda m: self.leads(page, m[1]), line)
                if not line.startswith("#"):
                    line = re.sub(r"`(--?[\w-]+)`", option, line)
                line = re.sub(r"^\[([^]]+)\]: (\S+)$", lambda m: f"[{m[1]}]: {self.items.get(m[1]) or self.leads(page, m[2])}", line)
            lines.append(line)
        return "\n".join(lines) + "\n"


def front(text: str) -> str:
    """The first page: what the README says, with its picture beside its points."""
    intro, picture, rest = re.split(r"^(!\[.*?\]\(.*?\)\n\n\*.*?\*\n)", text, maxsplit=1, flags=re.MULTILINE | re.DOTALL)
    points, start = rest.split("\n## Start\n", 1)
    blocks = re.findall(r"^```console\n.*?^```\n", start, re.MULTILINE | re.DOTALL)
    table = start.split("\n## What you can do\n", 1)[1].split("\n## Licence\n")[0]
    columns = f'<div class="front">\n<div>\n\n{points}\n</div>\n<div class="picture">\n\n{picture}\n</div>\n</div>\n'
    return f"{intro}{blocks[-1]}\n{columns}\n[Build it and make a first mesh](start.md)\n\n## What you can do\n{table}"


def commands(program: str) -> str:
    """The help of the program and of its commands."""

    def help_of(*words: str) -> str:
        done = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "90", "NO_COLOR": "1"})
        return f"```text\n{done.stdout.rstrip()}\n```\n"

    main = help_of()
    names = re.findall(r"^  ([\w-]+) ", main.split("Commands:")[1].split("\n\n")[0], re.MULTILINE)
    parts = [f"# Commands\n\nWhat `tetdb --help` says, and the help of each command.\n\n{main}"]
    parts += [f"## tetdb {name}\n\n{help_of(name)}" for name in names if name != "help"]
    return "\n".join(parts)


def title(text: str) -> str:
    return re.search(r"^# (.*)$", text, re.MULTILINE)[1]  # type: ignore[index]


def main(program: str, api: str, folder: str, python: str = "") -> None:
    links, source = Links(Path(api)), Path(folder) / "src"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(GUIDE / "pictures", source / "pictures")
    shutil.copy(Path(__file__).with_name("site.css"), folder)
    (Path(folder) / "book.toml").write_text(BOOK.format(repository=PACKAGE["repository"]))

    texts = {name: links.rewritten(page) for page, name in links.pages.items()}
    texts["index.md"] = front(texts["index.md"])
    texts["commands.md"] = commands(program)
    texts["rust.md"] = "# Rust reference\n\nThe [documentation of the crate](api/tetdb/index.html) has every type and function.\n"
    if python:
        texts["python-reference.md"] = "# Python reference\n\nThe [documentation of the module](python/tetdb.html) has every class and function.\n"
    for name, text in texts.items():
        (source / name).write_text(text)

    def entry(name: str) -> str:
        return f"- [{title(texts[name])}]({name})"

    guide = [entry(f"{name}.md") for name in chapters()]
    reference = [entry(name) for name in ("commands.md", "rust.md", "python-reference.md", *OTHERS.values()) if name in texts]
    lines = ["# Summary\n", "[tetdb](index.md)\n", "# Guide\n", *guide, "\n# Reference\n", *reference]
    (source / "SUMMARY.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
