"""Hook of MkDocs: the repository's Markdown files as a site.

Pages keep their path in the repository, so that a link that works on a forge also works on the site. Links to other files lead
to the repository if `repo_url` is set, and are plain text otherwise. The navigation is that of docs/README.md. The references
are generated: C and C++ by Doxygen, Python by mkdocstrings.
"""

import json
import pathlib
import posixpath
import re
import shutil
import subprocess

from markdown import Extension
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["*.md", "core/**/*.md", "docs/**/*.md", "examples/*/*.md", "plugins/**/*.md", "python/*.md", "reports/*.md",
         "reports/*/README.md", "results/README.md", "tests/peers/*.md"]
IMAGES = ["docs/images/*", "plugins/**/*.png", "reports/paper/figures/*.svg", "reports/domains/*.svg",
          "examples/notebooks/*.ipynb"]
VERSION = re.search(r"^project\(relign-bench VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
INTERFACE = "reference/plugin_interface.md"
PYTHON = "reference/python.md"
LINK = re.compile(r"(?<!!)\[((?:[^][]|\[[^]]*\])*)\]\(([^)\s]+)\)")
ROW = re.compile(r"^\| (?:\[(.+?)\]\((\S+?)\)|(\w[^|[]*?)) *\|", re.M)


class TwoSpaces(Extension):
    """Blocks in lists are indented by two spaces, as forges read them; Python-Markdown expects four."""

    def extendMarkdown(self, md):  # noqa: N802
        """Makes the parser again, before other extensions change it."""
        md.tab_length = 2
        md.build_parser()


def on_config(config):
    """Navigation from the tables of docs/README.md: a table's heading is a section, the first link of a row is a page."""
    sections = []
    for title, target, heading in ROW.findall((ROOT / "docs" / "README.md").read_text()):
        if heading:
            sections.append({heading.split(",")[0].capitalize(): []})
        elif "#" not in target:  # a part of a page that another row has
            page = page_of(posixpath.normpath(posixpath.join("docs", target)))
            entries = next(iter(sections[-1].values()))
            if page != "README.md":  # the start
                entries.append(page if title.endswith(".md") or "/" in title else {title: page})
    config.markdown_extensions.insert(0, TwoSpaces())
    config.nav = [{"Start": ["README.md", "docs/README.md"]}, *sections, {"Reference": [INTERFACE, PYTHON]}]
    config.copyright = f"relign-bench {VERSION}"  # in the footer, also without scripts and web server
    if pathlib.Path(config.site_dir) == ROOT / "build" / "site":  # not while serving
        config.site_dir = str(ROOT / "build" / "site" / VERSION)
        if config.site_url:
            config.site_url = f"{config.site_url.rstrip('/')}/{VERSION}/"
    return config


def on_post_build(config):
    """The list of versions for the theme's selector, from the folders beside this one, and a page that leads to the newest."""
    folder = pathlib.Path(config.site_dir).parent
    if folder != ROOT / "build" / "site":
        return
    found = [path.parent.name for path in folder.glob("*/index.html") if re.fullmatch(r"\d+\.\d+\.\d+", path.parent.name)]
    found.sort(key=lambda name: [int(part) for part in name.split(".")], reverse=True)
    (folder / "versions.json").write_text(json.dumps([{"version": name, "title": name, "aliases": []} for name in found]))
    start = f"{found[0]}/index.html"
    (folder / "index.html").write_text(f'<!doctype html><title>relign-bench</title>'
                                       f'<meta http-equiv="refresh" content="0; url={start}">'
                                       f'<a href="{start}">relign-bench {found[0]}</a>\n')


def page_of(path):
    """The page for a path of the repository; a folder's page is its README.md."""
    return f"{path}/README.md" if (ROOT / path / "README.md").is_file() else path


def on_files(files, config):
    """The repository's pages and images, and the generated references."""
    kept = [file for file in files if file.src_dir != config.docs_dir]  # those of the theme
    found = sorted({path for pattern in PAGES + IMAGES for path in ROOT.glob(pattern)})
    for path in found:
        kept.append(File(path.relative_to(ROOT).as_posix(), str(ROOT), config.site_dir, config.use_directory_urls))
    html = doxygen(ROOT / "build" / "doxygen")
    for path in sorted(html.iterdir()):
        kept.append(File.generated(config, f"reference/cpp/{path.name}", abs_src_path=str(path)))
    kept.append(File.generated(config, INTERFACE, content=interface_page()))
    kept.append(File.generated(config, PYTHON, content=python_page()))
    return Files(kept)


def doxygen(folder):
    """Runs Doxygen and returns the folder of its pages. A warning is an error (Doxyfile)."""
    if not shutil.which("doxygen"):
        raise PluginError("doxygen was not found (Debian and Ubuntu: doxygen)")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    settings = (ROOT / "docs" / "site" / "Doxyfile").read_text() + (f"OUTPUT_DIRECTORY = \"{folder}\"\n"
                                                                             f"PROJECT_NUMBER = {VERSION}\n")
    done = subprocess.run(["doxygen", "-"], input=settings, cwd=ROOT, text=True, check=False, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE)
    if done.returncode != 0:
        raise PluginError(f"doxygen failed:\n{done.stderr}")
    return folder / "html"


def interface_page():
    """The page that leads to Doxygen's."""
    folder = ROOT / "core" / "plugin_api"
    headers = sorted(folder.rglob("*.h*"))
    names = [path.name for path in headers]

    def page_of(path):
        """Doxygen's name of a header's page: with the folder's where two headers have the same name."""
        name = path.name if names.count(path.name) == 1 else f"{path.parent.name}/{path.name}"
        return name.replace("_", "__").replace(".", "_8").replace("/", "_2") + ".html"

    rows = [f"| [{path.relative_to(folder)}](cpp/{page_of(path)}) |" for path in headers]
    return "\n".join(["# Plugin interface in C and C++", "", "All [files](cpp/files.html), [classes](cpp/annotated.html) and "
                      "[C functions, constants and types](cpp/globals.html).", "", "| header |", "|---|", *rows, ""])


def python_page():
    """Directives for mkdocstrings: the public names of the package and of its modules."""
    modules = ["relign_bench", "relign_bench.rewards", "relign_bench.plugin"]
    lines = ["# Python package", ""]
    for module in modules:
        file = ROOT / "python" / pathlib.Path(*module.split("."))
        text = (file / "__init__.py" if file.is_dir() else file.with_suffix(".py")).read_text()
        names = re.search(r"^__all__ = \[(.*?)\]", text, re.S | re.M)
        lines += [f"::: {module}", "    options:", "      members: false", ""] if names else [f"::: {module}", ""]
        for name in re.findall(r'"(\w+)"', names[1]) if names else []:
            lines += [f"::: {module}.{name}", "    options: { heading_level: 3 }", ""]
    return "\n".join(lines)


def on_page_markdown(markdown, page, config, files):
    """Links to files that are no pages lead to the repository, or become plain text."""
    if page.file.src_uri in (INTERFACE, PYTHON):
        return markdown
    folder = posixpath.dirname(page.file.src_uri)
    if posixpath.basename(page.file.src_uri).startswith("tutorial_"):
        page.meta["search"] = {"boost": 3}  # before references that have the same words

    def rewritten(match):
        text, target = match.groups()
        path, mark, anchor = target.partition("#")
        if not path or re.match(r"[a-z]+:", path):
            return match[0]
        place = posixpath.normpath(posixpath.join(folder, path))
        if files.get_file_from_path(place):
            return match[0]
        if files.get_file_from_path(page_of(place)):
            return f"[{text}]({posixpath.relpath(page_of(place), folder or '.')}{mark}{anchor})"
        if not (ROOT / place).exists():
            return match[0]  # MkDocs warns
        if config.repo_url:
            return f"[{text}]({config.repo_url.rstrip('/')}/blob/HEAD/{place}{mark}{anchor})"
        return text

    return outside_fences(markdown, rewritten)


def outside_fences(markdown, rewritten):
    """Applies a function to every link outside fenced code."""
    parts = re.split(r"(^ *```.*?^ *```)", markdown, flags=re.S | re.M)
    return "".join(part if number % 2 else LINK.sub(rewritten, part) for number, part in enumerate(parts))
