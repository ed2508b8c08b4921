"""A member of a study in a process of its own: `python -m rumple._member DIRECTORY NUMBER`, started by studies."""

import sys

from ._rumple import Error, member


def main() -> int:
    try:
        member(sys.argv[1], int(sys.argv[2]))
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
