"""The text of a terminal as a picture: COMMAND... > OUT.svg

Runs the command with colour and draws what it prints, the command line first.
"""

import html
import os
import re
import subprocess
import sys
import textwrap

CHARACTER, LINE, MARGIN = 8.4, 19, 16
WIDTH = 80
COLOURS = {"31": "#d55e00", "32": "#2f9e57", "33": "#b8860b"}
MOST_LINES = 40


def spans(line):
    """Pieces of a line with their bold and colour."""
    bold, colour, out = False, None, []
    for piece in re.split(r"(\x1b\[[0-9;]*m)", line):
        code = re.fullmatch(r"\x1b\[([0-9;]*)m", piece)
        if not code:
            if piece:
                out.append((piece, bold, colour))
            continue
        for number in code[1].split(";"):
            if number in ("", "0"):
                bold, colour = False, None
            elif number == "1":
                bold = True
            else:
                colour = COLOURS.get(number, colour)
    return out


def drawn(lines):
    plain = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in lines]
    width = CHARACTER * max(WIDTH, max(map(len, plain))) + 2 * MARGIN
    height = LINE * len(lines) + 2 * MARGIN
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height}" '
        f'viewBox="0 0 {width:.0f} {height}" role="img" font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" '
        f'font-size="14">',
        f"<title>{html.escape(plain[0])}</title><desc>{html.escape(' '.join(plain[1:]))}</desc>",
        '<rect width="100%" height="100%" rx="8" fill="#f6f7f8" stroke="#d0d0d0"/>',
    ]
    for row, line in enumerate(lines):
        x, y = MARGIN, MARGIN + LINE * row + 14
        for text, bold, colour in spans(line):
            weight = ' font-weight="bold"' if bold else ""
            length = CHARACTER * len(text)
            out.append(
                f'<text x="{x:.1f}" y="{y}" xml:space="preserve" textLength="{length:.1f}" '
                f'fill="{colour or "#222222"}"{weight}>{html.escape(text)}</text>'
            )
            x += length
    return "\n".join(out + ["</svg>", ""])


def main():
    command = sys.argv[1:]
    shown = " ".join(["cft-ident", *command[1:]])
    run = subprocess.run(
        command,
        env={**os.environ, "CLICOLOR_FORCE": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    lines = run.stdout.rstrip().split("\n")
    # a terminal breaks long lines of its own accord
    for line in run.stderr.rstrip().split("\n"):
        lines += textwrap.wrap(line, WIDTH, subsequent_indent="  ")
    sys.stdout.write(drawn([f"\x1b[1m$ {shown}\x1b[0m", *lines[:MOST_LINES]]))


if __name__ == "__main__":
    main()
