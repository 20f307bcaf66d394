"""The command line: ``python -m cft_ident lsq ..``, or ``cft-ident`` where the package is installed."""

import signal
import sys

from . import _native


def main() -> None:
    # as a program ends by Ctrl-C, which no Python code waits for here
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_native.main(["cft-ident", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
