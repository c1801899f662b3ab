"""For mkdocs: links to files outside of docs/ become the names of these files, since the site does not hold them."""

import re


def on_page_markdown(markdown, page, **_):
    depth = page.file.src_uri.count("/")
    outside = re.compile(r"\[([^\]]*)\]\((?:\.\./){%d}([^)#]*)[^)]*\)" % (depth + 1))
    return outside.sub(lambda link: f"{link[1]} (`{link[2]}` in the repository)", markdown)
