"""python -m tests.site: builds the documentation site from the pages of the repository.

    python -m tests.site [--out build/site] [--quick]

Pages are the README files, .docs/*.md, and what is generated: keys from the models, commands from the command line,
functions from their docstrings, a gallery from runs of shipped scenarios, notebooks executed, citation from
CITATION.cff. Nothing is written twice: a page of .docs takes a section of another one with
`<!-- section PAGE: HEAD -->`. Links between pages of the repository become links of the site; links to other files of
it become plain text, as the site does not hold them. Formulas between $$ or $ in .docs become MathML, so that the site
needs no script and no network for them.
`--quick` leaves out runs and notebooks.
"""

import argparse
import html
import inspect
import json
import os
import posixpath
import re
import shutil
import subprocess
import sys
import time
from base64 import b64decode
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import blocksim
from blocksim.cli.commands import COMMANDS, GROUPS, load_command
from tests.key_table import BEGIN, END, key_table

ROOT = Path(__file__).parents[1]
OWN = ROOT / ".docs"
PICTURES = (".png", ".svg", ".gif")
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
SECTION = re.compile(r"<!-- section (\S+): (.+?) -->")
FORMULA = re.compile(r"\$\$(.+?)\$\$", re.DOTALL)
INLINE = re.compile(r"(?<![\\$\w])\$([^$\n]+?)\$(?!\w)")
MOST_BYTES = 40_000_000
GALLERY: dict[str, tuple[str, ...]] = {  # shipped scenarios of seconds, and what is changed so that something happens
    "three_blocks": (),
    "three_blocks_nonsmooth": (),
    "three_blocks_release": (),
    "bounce": (),
    "slide": (),
    "dominoes": (),
    "slope": (),
    "shaking_table": (),
    "pulse": (),
    "drum_column": (),
    "record_column": (),
    "tilting_arch": ("ground.tilt=21 deg",),
    "tilting_wall": ("ground.tilt=34 deg", "time.end=3"),
    "arch": ("structures.0.thickness=1.02 m", "time.end=3"),
    "toppling_slope": ("friction.block_block=30 deg", "time.end=4"),
    "granite_wall": ("loads.push.magnitude=45 kN", "start.release=always", "time.end=0.8"),
    "dam": ("blocks.dam.width=3.4 m",),
    "soil/seawall": (),
}
INTRODUCTION = (
    "Every picture is of a scenario that comes with blocksim (`blocksim new scenarios scenarios` copies them), made by "
    "building this site; seconds are those of computing on one core of the machine that built it."
)
SECONDS = 6.0  # of an animation, at most


def repository_pages() -> list[str]:
    """Return the pages of the repository that the site shows, as paths from its root."""
    rooms = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "blocksim").rglob("*.md"))
    more = ["scenarios/README.md", "results/README.md", "results/release.md", "results/paper/README.md"]
    more += ["results/software_paper.md", ".github/CONTRIBUTING.md", "tests/README.md"]
    return ["README.md", *rooms, *(one for one in more if (ROOT / one).is_file())]


def place_of(page: str) -> str:
    """Return where a page of the repository lies in the site."""
    if page == "README.md":
        return "index.md"
    return page.removeprefix(".docs/").replace(".github/", "").replace("/README.md", "/index.md")


def section_of(page: str, head: str) -> str:
    """Return the text below a heading, up to the next one of its level. Raises ValueError where there is none."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.search(rf"^(#+) {re.escape(head)}\n(.*?)(?=^#{{1,2}} |\Z)", text, re.DOTALL | re.MULTILINE)
    if found is None:
        raise ValueError(f"{page} has no section {head!r}")
    return found[2].strip()


class Site:
    """The pages and pictures of a site on their way into a folder."""

    def __init__(self, folder: Path) -> None:
        """Begin with an empty folder."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        self.folder = folder
        own = [path.relative_to(ROOT).as_posix() for path in sorted(OWN.rglob("*.md"))]
        self.pages = {page: place_of(page) for page in (*repository_pages(), *own)}
        self.notebooks = sorted((ROOT / "scenarios/notebooks").glob("*.ipynb"))

    def write(self, place: str, text: str) -> None:
        """Write a page."""
        path = self.folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def copy_pages(self) -> None:
        """Write all pages of the repository with the links of the site."""
        for page, place in self.pages.items():
            text = (ROOT / page).read_text(encoding="utf-8")
            if page == "scenarios/README.md":  # the table has a page of its own
                before, _, rest = text.partition(BEGIN)
                keys = "Its own page: [all keys](../reference/keys.md).\n"
                text = f"{self.linked(before, page)}{keys}{self.linked(rest.partition(END)[2], page)}"
            else:
                if page.startswith(".docs/"):
                    text = typeset(text)
                text = self.linked(text, page)
                for found in SECTION.finditer(text):
                    text = text.replace(found[0], self.linked(section_of(found[1], found[2]), found[1], place))
            self.write(place, text)

    def linked(self, text: str, page: str, place: str = "") -> str:
        """Return a text of a page with links that hold where it is shown, outside of code."""
        parts = re.split(r"(^```.*?^```|`[^`\n]*`)", text, flags=re.DOTALL | re.MULTILINE)
        shown = place or self.pages[page]
        return "".join(
            part if number % 2 else LINK.sub(lambda found: self._link(found, page, shown), part)
            for number, part in enumerate(parts)
        )

    def _link(self, found: re.Match[str], page: str, shown: str) -> str:
        mark, text, target = found.groups()
        if urlsplit(target).scheme or target.startswith("#"):
            return found[0]
        path, _, anchor = target.partition("#")
        there = posixpath.normpath(posixpath.join(posixpath.dirname(page), path))
        if there.endswith(PICTURES):
            place = there.removeprefix(".docs/")
            (self.folder / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / there, self.folder / place)
        elif there == "scenarios/notebooks":
            place = f"notebooks/{self.notebooks[0].stem}.md"
        elif there in self.pages or f"{there}/README.md" in self.pages:
            place = self.pages.get(there) or self.pages[f"{there}/README.md"]
        elif there.startswith(".docs/"):  # a page that is generated
            place = there.removeprefix(".docs/")
        else:
            return text
        link = posixpath.relpath(place, posixpath.dirname(shown) or ".")
        return f"{mark}[{text}]({link}{f'#{anchor}' if anchor else ''})"


def typeset(text: str) -> str:
    """Return a text with its formulas as MathML."""
    convert = import_module("latex2mathml.converter").convert

    def block(found: re.Match[str]) -> str:
        formula = convert(" ".join(found[1].split()), display="block")
        return f'<div class="formula">{formula}</div>'

    def inline(found: re.Match[str]) -> str:
        formula = re.sub(r"[*_]", lambda sign: f"&#{ord(sign[0])};", convert(found[1]))
        return f"<span>{formula}</span>"  # an element of its own at the start of a line would be a block

    return INLINE.sub(inline, FORMULA.sub(block, text))


def commands_page() -> str:
    """Return all commands with their arguments and options."""
    lines = ["# Commands", "", "Generated from the program; `blocksim COMMAND --help` prints the same."]
    for head, names in GROUPS.items():
        lines += ["", f"## {head}"]
        for name in names:
            command = load_command(name)
            paragraphs = inspect.cleandoc(command.help or COMMANDS[name]).split("\n\n")
            lines += ["", f"### {name}", ""]
            for text in paragraphs:
                example = text.removeprefix("Example: ")
                is_example = example != text
                shown = " ".join(text.split())
                lines += ["```", re.sub(r"\s*\n\s*", " ", example), "```", ""] if is_example else [escaped(shown), ""]
            lines += ["| argument or option | meaning |", "| --- | --- |"]
            for param in command.params:
                flags = ", ".join((*param.opts, *param.secondary_opts))
                value = param.metavar or ""
                if param.param_type_name == "argument":
                    flags, value = value or param.name, ""
                told = " ".join((getattr(param, "help", "") or "").split())
                lines.append(f"| `{f'{flags} {value}'.strip()}` | {escaped(told).replace('|', chr(92) + '|')} |")
    return "\n".join(lines) + "\n"


def escaped(text: str) -> str:
    """Return a text as Markdown that shows it as it is, except code between backquotes."""
    parts = text.split("`")
    return "`".join(part if number % 2 else re.sub(r"([*_<>\[\]])", r"\\\1", part) for number, part in enumerate(parts))


SHOWN = ("Result", "Display")
CLASSES = {"Result": "blocksim.simulation", "Display": "blocksim.notebook"}


def api_page() -> str:
    """Return the functions for users, and what a result has, from their signatures and docstrings."""
    lines = ["# Python", "", paragraphs_of(blocksim.__doc__ or "")]
    for name in blocksim.__all__:
        lines += _member(name, getattr(blocksim, name), "##", f"blocksim.{name}")
    for name in SHOWN:
        shown = getattr(import_module(CLASSES[name]), name)
        lines += ["", f"## {name}", "", paragraphs_of(shown.__doc__ or "")]
        members = {key: value for kind in reversed(shown.__mro__) for key, value in vars(kind).items()}
        for key, value in members.items():
            if not key.startswith("_") and inspect.getdoc(value):
                lines += _member(key, value, "###", key)
    return "\n".join(lines) + "\n"


def _member(name: str, value: Any, level: str, shown: str) -> Iterator[str]:
    """Yield a heading, the signature of a function, and the docstring."""
    yield from ("", f"{level} {name}", "")
    if callable(value):
        own = inspect.signature(value)
        plain = [
            one.replace(annotation=inspect.Parameter.empty) for one in own.parameters.values() if one.name != "self"
        ]
        text = str(own.replace(parameters=plain, return_annotation=inspect.Signature.empty))
        yield from ("```python", f"{shown}{text}", "```", "")
    yield paragraphs_of(inspect.getdoc(value) or "")


def paragraphs_of(text: str) -> str:
    """Return a docstring as Markdown: examples as code, options as a list."""
    parts = []
    for part in inspect.cleandoc(text).split("\n\n"):
        if part.startswith(">>>"):
            parts.append(f"```pycon\n{part}\n```")
        elif "\nOptions:\n" in f"\n{part}":
            head, _, options = part.partition("Options:\n")
            entries = re.split(r"\n(?=    \S)", options)
            listed = [f"* `{key.strip()}`: {escaped(' '.join(told.split()))}" for key, _, told in
                      (entry.partition(":") for entry in entries)]  # fmt: skip
            parts += [escaped(" ".join(head.split())), "\n".join(listed)]
        else:
            parts.append(escaped(" ".join(part.split())))
    return "\n\n".join(parts)


def gallery_page(folder: Path) -> str:
    """Run the scenarios of the gallery; return the page, with pictures and animations in a folder."""
    folder.mkdir(parents=True)
    lines = ["# Gallery", "", INTRODUCTION]
    for name, settings in GALLERY.items():
        scenario = blocksim.load(ROOT / f"scenarios/{name}.toml", list(settings))
        result = blocksim.run(scenario)
        stem, end = name.replace("/", "_"), result.summary.simulated_time_s
        result.plot("final", dpi=110.0).save(folder / f"{stem}.png")
        speed = max(0.25, end / SECONDS) if end > 1.0 else 0.1
        result.animate(speed=speed, fps=12.0, width=560).save(folder / f"{stem}.gif")
        moved = result.summary.movement
        flags = "".join(f' --set "{one}"' for one in settings)
        lines += [
            "",
            f"## {scenario.description or name}",
            "",
            f"![{name}: animation](gallery/{stem}.gif)",
            f"![{name}: final state](gallery/{stem}.png)",
            "",
            "```",
            f"blocksim run scenarios/{name}.toml{flags}",
            "```",
            "",
            f"{len(result.columns['block'])} blocks, {end:.3g} s simulated in {result.summary.solver_seconds:.2g} s"
            + (f"; outcome: {moved.outcome}." if moved else "."),
        ]
    return "\n".join(lines) + "\n"


def notebook_page(path: Path, folder: Path) -> str:
    """Execute a notebook; return it as a page, with its pictures in a folder."""
    place = folder.parents[1] / "executed"  # beside the pages, so that no results are left in the repository
    shutil.copytree(ROOT / "scenarios", place, dirs_exist_ok=True, ignore=shutil.ignore_patterns("results"))
    book: Any = import_module("nbformat").read(path, as_version=4)
    resources = {"metadata": {"path": str(place / "notebooks")}}
    import_module("nbclient").NotebookClient(book, timeout=600, kernel_name="python3", resources=resources).execute()
    folder.mkdir(parents=True, exist_ok=True)
    parts, number = [], 0
    for cell in book.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for output in cell.outputs:
            data = output.get("data", {})
            text = data.get("text/html") or html.escape(data.get("text/plain") or output.get("text", ""))
            if "<iframe" in text:
                number += 1
                page = re.search(r'srcdoc="(.*?)"', text, re.DOTALL)
                (folder / f"{path.stem}-{number}.html").write_text(
                    html.unescape(page[1] if page else ""), encoding="utf-8"
                )
                parts.append(f'<iframe src="{path.stem}-{number}.html" class="report"></iframe>')
                continue
            for found in re.findall(r'data:image/(\w+);base64,([^"]+)', text):
                number += 1
                file = f"{path.stem}-{number}.{found[0]}"
                (folder / file).write_bytes(b64decode(found[1]))
                text = text.replace(f"data:image/{found[0]};base64,{found[1]}", file)
            lines = re.sub(r"\n\s*\n", "\n", text)  # an empty line would end the block of HTML
            parts.append(f'<div class="output">{lines}</div>' if "<" in text else f"```\n{text}\n```")
    return "\n\n".join(parts) + "\n"


def citation_page() -> str:
    """Return how to cite, from CITATION.cff."""
    text = (ROOT / ".github/CITATION.cff").read_text(encoding="utf-8")
    values = dict(re.findall(r'^(\w[\w-]*): "?([^"\n]+)"?$', text, re.MULTILINE))
    bibtex = ["@software{blocksim,", f"  title = {{{values['title']}}},", "  author = {{The blocksim authors}},"]
    bibtex += [f"  version = {{{blocksim.__version__}}},", f"  year = {{{values['date-released'][:4]}}},", "}"]
    named = "Cite the version that you used; `run.json` of every run holds it, with a hash of the code."
    return (
        "\n".join(["# How to cite", "", named, "", "```bibtex", *bibtex, "```", "", "```yaml", text.rstrip(), "```"])
        + "\n"
    )


class Links(HTMLParser):
    """All addresses and anchors of a page."""

    def __init__(self) -> None:
        """Begin with none."""
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the addresses and the anchor of an element."""
        values = dict(attrs)
        self.anchors |= {value for name in ("id", "name") if (value := values.get(name))}
        self.targets += [value for name in ("href", "src") if (value := values.get(name))]
        del tag


def broken_links(site: Path) -> list[str]:
    """Return the links of all pages of a site that lead nowhere, and addresses that a page loads from elsewhere."""
    pages: dict[Path, Links] = {}
    for path in sorted(site.rglob("*.html")):
        pages[path.resolve()] = Links()
        pages[path.resolve()].feed(path.read_text(encoding="utf-8"))
    found = []
    for path, links in pages.items():
        for target in links.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc or path.name == "404.html":
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if there.is_dir():
                there /= "index.html"
            is_broken = not there.exists() or (
                parts.fragment and there in pages and parts.fragment not in pages[there].anchors
            )
            if is_broken and parts.fragment != "__skip":
                found.append(f"{path.relative_to(site.resolve())}: {target}")
    return found


def build(out: Path, *, quick: bool = False, on_news: Callable[[str], object] = lambda _: None) -> int:
    """Build the site into a folder; return its size in bytes. Raises CalledProcessError, ValueError."""
    work = out.parent / f"{out.name}-pages"
    site = Site(work / "docs")
    site.copy_pages()
    site.write("reference/keys.md", f"# Keys of a scenario\n\nGenerated from the models.\n\n{key_table()}\n")
    site.write("reference/commands.md", commands_page())
    site.write("reference/python.md", api_page())
    site.write("citing.md", citation_page())
    on_news("pages written")
    titles = {path: json.loads(path.read_text(encoding="utf-8"))["cells"][0]["source"][0] for path in site.notebooks}
    if quick:
        site.write("gallery.md", "# Gallery\n")
    else:
        site.write("gallery.md", gallery_page(site.folder / "gallery"))
        on_news("gallery made")
    for path, title in titles.items():
        text = title if quick else notebook_page(path, site.folder / "notebooks")
        site.write(f"notebooks/{path.stem}.md", site.linked(text, "scenarios/README.md", f"notebooks/{path.stem}.md"))
    on_news("notebooks executed")
    for name in ("extra.css", "iframe-worker.js", "stix-two-math.woff2", "stix-two-math.txt"):
        shutil.copyfile(OWN / name, site.folder / name)
    shutil.copyfile(OWN / "mkdocs.yml", work / "mkdocs.yml")
    shutil.rmtree(out, ignore_errors=True)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    command += ["-f", str(work / "mkdocs.yml"), "-d", str(out.resolve())]
    environment = {**os.environ, "DISABLE_MKDOCS_2_WARNING": "true", "NO_MKDOCS_2_WARNING": "true"}
    subprocess.run(command, check=True, env=environment)
    broken = broken_links(out)
    if broken:
        raise ValueError("links that lead nowhere:\n" + "\n".join(broken))
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    if size > MOST_BYTES:
        raise ValueError(f"the site has {size / 1e6:.1f} MB, at most {MOST_BYTES / 1e6:.0f} MB are allowed")
    return size


def main() -> None:
    """Build the site; print its size and how long it took."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("--out", type=Path, default=ROOT / "build/site")
    parser.add_argument("--quick", action="store_true", help="without runs and notebooks")
    options, began = parser.parse_args(), time.monotonic()

    def tell(news: str) -> None:
        sys.stdout.write(f"{time.monotonic() - began:5.0f} s  {news}\n")
        sys.stdout.flush()

    size = build(options.out, quick=options.quick, on_news=tell)
    tell(f"{options.out / 'index.html'}: {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
