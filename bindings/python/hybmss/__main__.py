"""python -m hybmss SCENE.toml [OPTION...] runs a scene; python -m hybmss COMMAND ... is the program hybmss, which is in the package."""

import os
import pathlib
import sys


def main() -> None:
    program = str(pathlib.Path(__file__).parent / "bin/hybmss")
    arguments = sys.argv[1:]
    if arguments and arguments[0].endswith(".toml"):
        arguments.insert(0, "run")
    sys.stdout.flush()
    os.execv(program, [program, *arguments])


if __name__ == "__main__":
    main()
