"""Builds the site from docs/, the declarations of the components and the files that pages point to.

`python docs/site/build.py` writes build/site/html, with warnings as errors, and checks every link of it; programs find
the pages by llms.txt.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from base64 import b64decode
from pathlib import Path

from links import broken
from llms import llms

from modelica_like import load, schematic
from modelica_like.errors import NetlistError
from modelica_like.show.report.component_pages.library import write_component_pages

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent
ROOT = DOCS.parent
LINK = re.compile(r"\]\(([^)\s#]+)(#[^)\s]*)?\)")
WIDE = ("README.md", "components/README.md")
"""Pages without a list of their headings."""
_WIDE = "---\nhide:\n  - toc\n---\n\n"
KINDS = {".c": "c", ".h": "c", ".py": "python", ".toml": "toml"}
"""Endings of files that become pages, and their languages."""


def main() -> None:
    """Build the site, or end with what is wrong."""
    work = ROOT / "build" / "site"
    shutil.rmtree(work, ignore_errors=True)
    pages = work / "pages"
    shutil.copytree(DOCS, pages, ignore=shutil.ignore_patterns("site", "components", "__pycache__"))
    write_component_pages(DOCS / "components", ROOT / "examples")
    shutil.copytree(DOCS / "components", pages / "components")
    shutil.copy(HERE / "zensical.toml", work)
    shutil.copy(HERE / "site.css", pages)
    outside: set[Path] = set()
    for file in pages.glob("notebooks/*.ipynb"):
        _write_notebook(file)
    for page in pages.rglob("*.md"):
        wide = _WIDE if page.relative_to(pages).as_posix() in WIDE else ""
        page.write_text(wide + _inside(page, pages, outside), encoding="utf-8")
    for file in outside:
        _write_source(file, pages)
    paths = os.pathsep.join(filter(None, [str(HERE), os.environ.get("PYTHONPATH", "")]))
    command = [Path(sys.executable).parent / "zensical", "build", "--strict", "--config-file", work / "zensical.toml"]
    subprocess.run(command, check=True, cwd=work, env=os.environ | {"PYTHONPATH": paths})
    (work / "html" / "llms.txt").write_text(llms(pages, HERE / "zensical.toml"), encoding="utf-8")
    if found := broken(work / "html"):
        raise SystemExit("\n".join(found))


def _write_notebook(file: Path) -> None:
    """Write a notebook as a page, with its pictures beside it."""
    parts: list[str] = []
    for k, cell in enumerate(json.loads(file.read_text(encoding="utf-8"))["cells"]):
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "text" in output:
                parts.append(f"```text\n{''.join(output['text'])}```")
            for kind, ending in (("image/svg+xml", "svg"), ("image/png", "png")):
                if kind in data:
                    picture = file.with_name(f"{file.stem}_{k}.{ending}")
                    content = "".join(data[kind]).encode()
                    picture.write_bytes(b64decode(content) if ending == "png" else content)
                    parts.append(f"![what the cell shows]({picture.name})")
    parts.append(f"[The notebook as a file]({file.name})")
    file.with_suffix(".md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _inside(page: Path, pages: Path, outside: set[Path]) -> str:
    """Return a page whose links stay on the site; files outside docs become pages of their own."""
    original = DOCS / page.relative_to(pages)

    def moved(found: re.Match[str]) -> str:
        target, anchor = found[1], found[2] or ""
        file = (original.parent / target).resolve()
        if ":" in target or file.is_relative_to(DOCS) or not file.exists():
            return found[0]
        outside.add(file)
        line = re.fullmatch(r"#L(\d+)", anchor)
        anchor = f"#__codelineno-0-{line[1]}" if line else anchor
        return f"]({os.path.relpath(_place(file, pages), page.parent)}{anchor})".replace(os.sep, "/")

    return LINK.sub(moved, page.read_text(encoding="utf-8"))


def _place(file: Path, pages: Path) -> Path:
    place = pages / "files" / file.relative_to(ROOT)
    return place / "index.md" if file.is_dir() else place.with_name(f"{file.name}.md")


def _write_source(file: Path, pages: Path) -> None:
    """Write a file of the repository as a page, or a folder as a list of its files."""
    place, name = _place(file, pages), file.relative_to(ROOT).as_posix()
    place.parent.mkdir(parents=True, exist_ok=True)
    if file.is_dir():
        listed = [one for one in sorted(file.rglob("*")) if one.suffix in KINDS]
        for one in listed:
            _write_source(one, pages)
        links = [f"- [{one.relative_to(file).as_posix()}]({one.relative_to(file).as_posix()}.md)" for one in listed]
        text = "\n".join(links)
    elif file.suffix == ".md":
        text = LINK.sub(r"`\1`", file.read_text(encoding="utf-8"))
    elif drawing := _drawing(file):
        (place.parent / f"{file.name}.svg").write_text(drawing, encoding="utf-8")
        text = f'![schematic]({file.name}.svg)\n\n```toml linenums="1"\n{file.read_text(encoding="utf-8")}```'
    else:
        text = f'```{KINDS.get(file.suffix, "text")} linenums="1"\n{file.read_text(encoding="utf-8")}```'
    title = "" if file.suffix == ".md" else f"# {name}\n\n"
    place.write_text(f"---\nsearch:\n  exclude: true\n---\n\n{title}{text}\n", encoding="utf-8")


def _drawing(file: Path) -> str:
    """Return the schematic of a netlist; no text for other files, systems of FMUs among them."""
    if file.suffix != ".toml" or "[parts" not in file.read_text(encoding="utf-8"):
        return ""
    try:
        return schematic(load(file))
    except NetlistError:
        return ""


if __name__ == "__main__":
    main()
