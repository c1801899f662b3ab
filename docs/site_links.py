"""For mkdocs: orders the search's results by kinds of pages, and reads pages as GitHub does, from which mkdocs differs in
three ways:

- links to files outside of docs/ become the names of these files, since the site does not hold them;
- a list or a table needs an empty line before it, which pages that are read as files go without;
- what belongs to an item of a list is indented by four columns.
"""

import re
import textwrap

# Factors of scores in the search: the page that lists all keys, and explanations, come before pages that mention a word.
# Pages for developers and histories come last.
BOOSTS = {"reference/configuration": 2, "explanation/": 1.3, "developer/": 0.5, "research/": 0.05, "changelog/": 0.05}
ITEM = re.compile(r" *([-*] |\d+\. )")


def on_page_markdown(markdown, page, **_):
    for start, boost in BOOSTS.items():
        if page.file.src_uri.startswith(start):
            page.meta["search"] = {"boost": boost}
    if is_help(page):
        markdown = "\n".join(line for long in markdown.split("\n") for line in wrapped_help(long))
    depth = page.file.src_uri.count("/")
    outside = re.compile(r"\[([^\]]*)\]\((?:\.\./){%d}([^)#]*)[^)]*\)" % (depth + 1))
    return as_python_markdown(outside.sub(lambda link: f"{link[1]} (`{link[2]}` in the repository)", markdown))


def as_python_markdown(markdown):
    lines, in_code = [], False
    block = ""  # kind of the lines since the last empty line: text, an item's text, a table, or code
    items = []  # columns at which the text of the open items begins, outermost first
    for line in markdown.split("\n"):
        text = line.lstrip(" ")
        column = len(line) - len(text)
        if text and not in_code:
            while items and column < items[-1]:
                items.pop()
        shift = 4 * len(items) - items[-1] if items and text else 0
        if not in_code and text:
            item = ITEM.match(line) if column < 4 + (items[-1] if items else 0) else None
            kind = "item" if item else "table" if text.startswith("|") else block if block in ("item", "table") else "text"
            if block and kind != block and (kind == "table" or block != "item"):
                lines.append("")
            block = kind
            if item:
                items.append(item.end())
        elif not in_code:
            block = ""
        lines.append(" " * (column + shift) + text)
        if text.startswith("```"):
            in_code, block = not in_code, "code" if in_code else ""
    return "\n".join(lines)


def is_help(page):
    return page.file.src_uri.startswith("reference/commands/")


def wrapped_help(line):
    """A line of a help text as lines of at most 96 columns, indented like its descriptions; examples stay whole."""
    is_option = re.match(r"  -|  [A-Z]| {30}\S", line)
    return textwrap.wrap(line, 96, subsequent_indent=" " * 30, break_on_hyphens=False) if is_option else [line]


def on_page_content(html, page, **_):
    """Marks what docs/site.css keeps whole or wide on narrow screens: help texts, short code, numbers and long cells."""
    if is_help(page):
        html = html.replace('<div class="highlight">', '<div class="highlight help">')
    html = re.sub(r"<code>([^<\s]{1,24})</code>", r'<code class="short">\1</code>', html)
    return re.sub(r"<td>(.*?)</td>", with_width, html)


def with_width(cell):
    length = len(re.sub(r"<[^>]*>", "", cell[1]))
    if 25 < length and "<img" not in cell[1]:
        return f'<td class="wide">{cell[1]}</td>'
    return f'<td class="short">{cell[1]}</td>' if length < 15 else cell[0]
