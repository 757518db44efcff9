"""Hook of MkDocs: pages outside docs/ become pages of the site, with links that lead there."""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
    "src/roboirg/evaluation/analysis/published_results/README.md": "published-results.md",
}
"""The site's name of each page outside docs/."""
LINK = re.compile(r"(\]\()([^)\s#]+)")
NOTEBOOK_LINK = re.compile(r'(href="(?!https?:)[^"#:]+)\.(?:md|ipynb)(?=["#])')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that lie outside docs/."""
    for source, name in PAGES.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    return files


def on_page_markdown(markdown: str, page: object, **_: object) -> str:
    """Change links between files of the repository into links between pages of the site."""
    uri = page.file.src_uri  # type: ignore[attr-defined]
    source = next((one for one, name in PAGES.items() if name == uri), f"docs/{uri}")
    folder = (ROOT / source).parent

    def change(link: re.Match[str]) -> str:
        target = link.group(2)
        if "://" in target:
            return link.group(0)
        path = (folder / target).resolve().relative_to(ROOT).as_posix()
        name = PAGES.get(path, path.removeprefix("docs/"))
        return f"{link.group(1)}{'../' * uri.count('/')}{name}"

    return LINK.sub(change, markdown)


def on_post_page(output: str, page: object, **_: object) -> str:
    """Change the links of notebooks, which are HTML already, to the pages of the site."""
    if not page.file.src_uri.endswith(".ipynb"):  # type: ignore[attr-defined]
        return output
    return NOTEBOOK_LINK.sub(r"\1.html", output)
