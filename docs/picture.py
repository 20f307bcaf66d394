"""A picture of a page: PAGE.html WORDS > OUT.svg

The first picture below the first caption, or with the first title, that holds WORDS.
"""

import re
import sys


def pictures_in(text):
    """Whole pictures; one may hold others."""
    depth, start = 0, 0
    for mark in re.finditer(r"<svg|</svg>", text):
        if mark[0] == "<svg":
            start = mark.start() if depth == 0 else start
            depth += 1
        else:
            depth -= 1
            if depth == 0:
                yield text[start : mark.end()]


def main():
    page, words = open(sys.argv[1], encoding="utf-8").read(), sys.argv[2]
    for figure in re.findall(r"<figure.*?</figure>", page, re.S):
        caption = re.search(r"<figcaption>(.*?)</figcaption>", figure, re.S)
        _, _, body = figure.partition('<div class="still')
        pictures = list(pictures_in(body))
        if not pictures:
            continue
        title = re.search(r"<title>(.*?)</title>", pictures[0], re.S)
        if words in (caption[1] if caption else "") or words in title[1]:
            print(pictures[0])
            return
    sys.exit(f"{sys.argv[1]}: no picture of {words}")


if __name__ == "__main__":
    main()
