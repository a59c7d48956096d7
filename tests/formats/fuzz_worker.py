"""Reads damaged files in a process of its own, under a limit of memory; run by test_fuzz_formats.py.

    python -W error fuzz_worker.py FOLDER COUNT FORMAT ...

Prints JSON: by format how many files were read and refused, the slowest [s of CPU], and what went wrong. Case k of a
format is the same in every run.
"""

import json
import resource
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from format_cases import ARGUMENTS, SMALL_MERL, examples_of

from brdfcore.errors import BrdfError
from brdfcore.formats import Samples, curet, merl, read

MEMORY = 512 * 2**20  # bytes that reading small files may take beyond what the process starts with
LARGEST = 400_000  # bytes of a file that a case makes
WORDS = b"nan inf -1 1e999 1e-400 0 -0 99999999999999999999 1,5 0x10 1_000 \xc3\xa9 \xff \0 # \n\n , ;;".split(b" ")
NUMBERS = [0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1]

Random = np.random.Generator
Damage = Callable[[bytes, Random], bytes]


def truncated(content: bytes, random: Random) -> bytes:
    return content[: random.integers(len(content))]


def flipped(content: bytes, random: Random) -> bytes:
    damaged = bytearray(content)
    for at in random.integers(len(content), size=random.integers(1, 4)):
        damaged[at] ^= 1 << random.integers(8)
    return bytes(damaged)


def spliced(content: bytes, random: Random) -> bytes:
    at = random.integers(len(content))
    return content[:at] + random.bytes(random.integers(0, 16)) + content[at + random.integers(0, 9) :]


def with_another_number(content: bytes, random: Random) -> bytes:
    """A length, a count or a dimension that is wrong, where one may be."""
    size = int(random.choice([1, 2, 4, 8]))
    at = random.integers(len(content))
    number = int(NUMBERS[random.integers(len(NUMBERS))]) % 2 ** (8 * size)
    return content[:at] + number.to_bytes(size, "little") + content[at + size :]


def with_another_word(content: bytes, random: Random) -> bytes:
    words = content.split(b" " if b" " in content else b",")
    words[random.integers(len(words))] = WORDS[random.integers(len(WORDS))]
    return (b" " if b" " in content else b",").join(words)


def rearranged(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    i, j = random.integers(len(lines), size=2)
    return b"\n".join([lines[:i] + lines[j:], lines[:i] + lines[i : i + 1] * 50 + lines[i:]][random.integers(2)])


def oversized(content: bytes, random: Random) -> bytes:
    """A piece that comes again and again."""
    start, stop = sorted(int(k) for k in random.integers(len(content), size=2))
    piece = content[start : stop + 1]
    times = int(random.integers(2, max(3, LARGEST // len(piece))))
    return content[:start] + piece * min(times, LARGEST // len(piece)) + content[stop + 1 :]


def random_bytes(content: bytes, random: Random) -> bytes:
    return random.bytes(random.integers(1, 300))


DAMAGES: list[Damage] = [
    truncated,
    flipped,
    spliced,
    with_another_number,
    with_another_word,
    rearranged,
    oversized,
    random_bytes,
]


def cases(name: str, examples: dict[str, bytes], table: bytes, count: int) -> Iterator[tuple[int, bytes, bytes]]:
    """Case number, the file's content and that of CUReT's table, of which one is damaged."""
    for case in range(count):
        random = np.random.default_rng([zlib.crc32(name.encode()), case])
        if case % 10 == 9:  # another format's file, whole or not
            other = examples[sorted(examples)[random.integers(len(examples))]]
            yield case, other if random.integers(2) else flipped(other, random), table
            continue
        damage = DAMAGES[case % len(DAMAGES)]
        if name == "curet" and random.integers(2):
            yield case, examples[name], damage(table, random)
        else:
            yield case, damage(examples[name], random), table


def main() -> None:
    folder, count, names = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    merl.SHAPE = SMALL_MERL
    examples = examples_of(folder)
    table_path, path = folder / curet.TABLE, folder / "damaged"
    table = table_path.read_bytes()
    for name, content in examples.items():  # what reading loads once is not what a file costs
        path.write_bytes(content)
        read(path, **ARGUMENTS.get(name, {}))
    status = Path("/proc/self/status").read_text()
    limit = int(status.split("VmData:")[1].split()[0]) * 1024 + MEMORY
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    found = {}
    for name in names:
        counts = {"read": 0, "refused": 0}
        wrong: list[str] = []
        slowest = 0.0
        for case, content, beside in cases(name, examples, table, count):
            path.write_bytes(content)
            table_path.write_bytes(beside)
            before = time.process_time()
            try:
                samples = read(path, format=name if case % 3 else None, **(ARGUMENTS.get(name, {}) if case % 3 else {}))
                counts["read"] += 1
                if not isinstance(samples, Samples) or len(samples) == 0:
                    wrong.append(f"case {case}: {samples!r}")
            except BrdfError as error:
                counts["refused"] += 1
                text = str(error)
                if not (text.startswith("Expected ") and text.endswith(".") and len(text) < 2500 and "\n" not in text):
                    wrong.append(f"case {case}: {text[:300]!r}")
                if "MemoryError" in text or "allocat" in text:
                    wrong.append(f"case {case}: memory: {text[:300]!r}")
            except BaseException as error:
                wrong.append(f"case {case}: {type(error).__name__}: {error}")
            slowest = max(slowest, time.process_time() - before)
        found[name] = {**counts, "slowest": slowest, "wrong": wrong[:5] + wrong[5:][-1:]}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
