"""A member of a study in a process of its own: `python -m rumple._member LAW DIRECTORY NUMBER`, started by studies.

LAW is the file of a pickled law, or empty.
"""

import pickle
import sys
from pathlib import Path

from ._rumple import Error, member


def main() -> int:
    kept, root, number = sys.argv[1:]
    try:
        law = None
        if kept:
            # The law may be of a module that only the path of the caller leads to.
            sys.path[:], pickled = pickle.loads(Path(kept).read_bytes())
            law = pickle.loads(pickled)
        member(root, int(number), law)
    except Error as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
