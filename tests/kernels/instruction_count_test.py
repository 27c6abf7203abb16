#!/usr/bin/python3
"""Counts the vector arithmetic of the AVX-512 float step's inner loop in the object code.

    instruction_count_test.py LIBRARY     the archive (or object) that holds the kernels

Times wander; the number of instructions does not: a change that makes the compiler compute something twice, or that
takes a value out of a register for good, shows here on any machine. Ends with 77 (skipped) where there is no objdump or
no AVX-512 kernel.
"""

import collections
import re
import shutil
import subprocess
import sys

# Vector-arithmetic instructions per 16 cells: multiply-adds, additions, shuffles, integer operations, estimates.
LIMIT = 460

KERNEL = re.compile(
    r"lattice_layer<true, \(hybmss::kernels::Volume\)1, \(hybmss::(?:kernels::)?Accuracy\)1, .*batch<float, xsimd::avx512bw>"
)
SPRINGS = 13  # of a cell, each with one reciprocal square root
WIDTH = 16
SKIPPED = 77


def kernel_instructions(listing):
    """(address, operation, operands) of every instruction of the kernel."""
    instructions, inside = [], False
    for line in listing.splitlines():
        head = re.match(r"^[0-9a-f]+ <(.*)>:$", line)
        if head:
            inside = bool(KERNEL.search(head.group(1)))
            continue
        body = re.match(r"\s*([0-9a-f]+):\s+(\S+)\s*(.*)", line) if inside else None
        if body:
            instructions.append((int(body.group(1), 16), body.group(2), body.group(3)))
    return instructions


def ways_around(instructions, head):
    """Every way from the instruction `head` back to it that passes nothing twice: lists of (operation, operands)."""
    place = {address: i for i, (address, _, _) in enumerate(instructions)}
    ways, open_ends = [], [(head, [])]
    while open_ends:
        at, passed = open_ends.pop()
        seen = set(passed)
        while at is not None and at < len(instructions) and at not in seen:
            passed.append(at)
            seen.add(at)
            _, operation, operands = instructions[at]
            following = at + 1
            if operation == "ret":
                following = None
            elif operation.startswith("j"):
                target = re.match(r"([0-9a-f]+)", operands)
                target = place.get(int(target.group(1), 16)) if target else None
                if operation.startswith("jmp"):
                    following = target
                elif target is not None:
                    open_ends.append((target, list(passed)))
                    if target == head:
                        ways.append(passed[:])
            at = following
            if at == head:
                ways.append(passed)
                break
    return [[instructions[i][1:] for i in way] for way in {tuple(way) for way in ways}]


def arithmetic_of(way):
    return sum(operation.startswith("v") and not operation.startswith(("vmov", "vbroadcast")) for operation, _ in way)


def roots_of(way):
    return sum(operation in ("vrsqrt14ps", "vsqrtps") for operation, _ in way)


def inner_loop(instructions):
    """The loop over vectors of cells; of its ways, one for each thing done with a finished node, the longest, which
    is that of a step with gravity and damping."""
    place = {address: i for i, (address, _, _) in enumerate(instructions)}
    heads = set()
    for i, (_, operation, operands) in enumerate(instructions):
        target = re.match(r"([0-9a-f]+)", operands) if operation.startswith("j") else None
        start = place.get(int(target.group(1), 16)) if target else None
        if start is not None and start <= i:
            heads.add(start)
    ways = [way for head in heads for way in ways_around(instructions, head)]
    ways = [way for way in ways if roots_of(way) and roots_of(way) % SPRINGS == 0]
    return max(ways, key=arithmetic_of, default=[])


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if shutil.which("objdump") is None:
        print("skipped: there is no objdump")
        return SKIPPED
    dump = subprocess.run(
        ["objdump", "-d", "-C", "--no-show-raw-insn", sys.argv[1]], capture_output=True, text=True, check=True
    )
    if "avx512" not in dump.stdout:
        print(f"skipped: {sys.argv[1]} holds no AVX-512 code")
        return SKIPPED
    instructions = kernel_instructions(dump.stdout)
    if not instructions:
        print(f"FAILED: no function in {sys.argv[1]} matches {KERNEL.pattern}; has the kernel another name now?")
        return 1
    loop = inner_loop(instructions)
    if not loop:
        print(f"FAILED: no loop of the kernel holds {SPRINGS} reciprocal square roots or a multiple of them")
        return 1
    cells = WIDTH * roots_of(loop) // SPRINGS
    arithmetic = arithmetic_of(loop)
    count = collections.Counter(operation for operation, _ in loop)
    stack = [operands for operation, operands in loop if operation.startswith("v") and re.search(r"\(%r[sb]p\)", operands)]
    spills = sum(operands.rstrip().endswith(")") for operands in stack)
    per_16 = arithmetic * 16 / cells
    print(f"{per_16:g} vector-arithmetic instructions per 16 cells (at most {LIMIT}); {len(loop)} instructions "
          f"per {cells} cells in all, {spills} vector stores to the stack and {len(stack) - spills} loads from it")
    for operation, n in count.most_common(12):
        print(f"  {n:4d} {operation}")
    if per_16 > LIMIT:
        print("FAILED: more than allowed")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
