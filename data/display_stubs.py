"""Stand-ins for libGL and libX11 from ``symbols.txt``: the same bytes everywhere, without a compiler.

``python data/display_stubs.py`` writes them into the package; with ``--list FOLDER`` it first reads which
functions the shared objects in FOLDER (site-packages, or an unpacked wheel of DART) import, and adds them to the list.

One object is a minimal ELF file after the System V ABI: a segment to execute (header, hash table, symbols, names, one
function that returns 0 under every name) and one to write (the dynamic section, which older loaders relocate).
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from kendama_cli.robot_model.display import MACHINES, SONAMES, stub_path

SYMBOLS = stub_path("libGL.so.1", "x86_64").with_name("symbols.txt")
PREFIXES = {"libGL.so.1": "gl", "libX11.so.6": "X"}
ELF_MACHINE = {"x86_64": 62, "aarch64": 183}
RETURN_0 = {
    "x86_64": bytes.fromhex("31c0c3"),  # xor eax, eax; ret
    "aarch64": bytes.fromhex("000080d2c0035fd6"),  # mov x0, #0; ret
}
PAGE = 0x10000
"""The largest page of either machine; segments must not share one."""
HEADER, PROGRAM_HEADER, SYMBOL = 64, 56, 24
DT_HASH, DT_STRTAB, DT_SYMTAB, DT_STRSZ, DT_SYMENT, DT_SONAME = 4, 5, 6, 10, 11, 14
READ, WRITE, EXECUTE = 4, 2, 1


def read_symbols() -> dict[str, list[str]]:
    """Return the functions of each library, from ``symbols.txt``."""
    found: dict[str, list[str]] = {}
    soname = ""
    for line in SYMBOLS.read_text(encoding="ascii").splitlines():
        if line.startswith("  "):
            found[soname].append(line.strip())
        elif not line.startswith("#"):
            soname = line
            found[soname] = []
    return found


def stub(soname: str, functions: Iterable[str], machine: str) -> bytes:
    """Return a shared object called ``soname`` in which each of ``functions`` returns 0."""
    names = sorted(functions)
    strings = b"\0" + b"".join(name.encode() + b"\0" for name in [soname, *names])
    offset = {name: strings.index(b"\0" + name.encode() + b"\0") + 1 for name in [soname, *names]}
    n_segments = 4
    hash_at = HEADER + n_segments * PROGRAM_HEADER
    table = _hash_table(names)
    symbols_at = _aligned(hash_at + len(table), 8)
    strings_at = symbols_at + SYMBOL * (len(names) + 1)
    code_at = _aligned(strings_at + len(strings), 16)
    code = RETURN_0[machine]
    dynamic_at = _aligned(code_at + len(code), 16)
    dynamic = b"".join(
        struct.pack("<QQ", tag, value)
        for tag, value in [
            (DT_SONAME, offset[soname]),
            (DT_HASH, hash_at),
            (DT_STRTAB, strings_at),
            (DT_SYMTAB, symbols_at),
            (DT_STRSZ, len(strings)),
            (DT_SYMENT, SYMBOL),
            (0, 0),
        ]
    )
    function, section = 0x12, 1  # a global function, defined in some section
    symbols = bytes(SYMBOL) + b"".join(
        struct.pack("<IBBHQQ", offset[name], function, 0, section, code_at, len(code)) for name in names
    )
    header = struct.pack(
        "<16sHHIQQQIHHHHHH",
        b"\x7fELF\x02\x01\x01", 3, ELF_MACHINE[machine], 1, 0, HEADER, 0, 0,
        HEADER, PROGRAM_HEADER, n_segments, 64, 0, 0,
    )  # fmt: skip
    load, dynamic_kind, stack = 1, 2, 0x6474E551
    segments = (
        _segment(load, READ | EXECUTE, 0, 0, code_at + len(code), PAGE)
        + _segment(load, READ | WRITE, dynamic_at, dynamic_at + PAGE, len(dynamic), PAGE)
        + _segment(dynamic_kind, READ | WRITE, dynamic_at, dynamic_at + PAGE, len(dynamic), 8)
        + _segment(stack, READ | WRITE, 0, 0, 0, 16)  # no executable stack
    )
    image = bytearray(dynamic_at + len(dynamic))
    parts = [(0, header), (HEADER, segments), (hash_at, table), (symbols_at, symbols)]
    for at, part in [*parts, (strings_at, strings), (code_at, code), (dynamic_at, dynamic)]:
        image[at : at + len(part)] = part
    return bytes(image)


def imported_functions(paths: Iterable[Path]) -> dict[str, set[str]]:
    """Return the functions of libGL and libX11 that 64-bit little-endian shared objects leave undefined, by soname."""
    found: dict[str, set[str]] = {soname: set() for soname in SONAMES}
    for path in paths:
        for name in _undefined(path.read_bytes()):
            for soname, prefix in PREFIXES.items():
                # glX... and gl... are libGL's, XOpenDisplay and XkbKeycodeToKeysym are libX11's
                if name.startswith(prefix) and name[len(prefix) : len(prefix) + 1].isalpha():
                    found[soname].add(name)
    return found


def shared_objects(folder: Path) -> list[Path]:
    """Return DART's shared objects in ``folder``: the module, and the libraries of its wheel."""
    return [*sorted(folder.glob("dartpy*.so")), *sorted(folder.glob("dartpy.libs/*.so*"))]


def _undefined(data: bytes) -> list[str]:
    """Return the names of the dynamic symbols that an ELF file imports."""
    (sections_at,) = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, sections_at + i * size) for i in range(count)]
    dynamic_symbols = 11
    names = []
    for _, kind, _, _, at, length, link, _, _, entry in sections:
        if kind != dynamic_symbols:
            continue
        strings_at = sections[link][4]
        for place in range(at + entry, at + length, entry):
            name, _, _, section = struct.unpack_from("<IBBH", data, place)
            if section == 0:
                start = strings_at + name
                names.append(data[start : data.index(b"\0", start)].decode())
    return names


def _hash_table(names: list[str]) -> bytes:
    """Return the System V hash table of symbols 1, 2, ... called ``names``."""
    buckets = [0] * max(1, len(names) // 2)
    chains = [0] * (len(names) + 1)
    for number, name in enumerate(names, 1):
        place = _hash(name) % len(buckets)
        chains[number], buckets[place] = buckets[place], number
    return struct.pack(f"<{2 + len(buckets) + len(chains)}I", len(buckets), len(chains), *buckets, *chains)


def _hash(name: str) -> int:
    value = 0
    for letter in name.encode():
        value = (value << 4) + letter
        high = value & 0xF0000000
        value = (value ^ (high >> 24)) & ~high & 0xFFFFFFFF
    return value


def _segment(kind: int, flags: int, at: int, address: int, size: int, align: int) -> bytes:  # noqa: PLR0917
    # in the order of Elf64_Phdr
    return struct.pack("<IIQQQQQQ", kind, flags, at, address, address, size, size, align)


def _aligned(value: int, step: int) -> int:
    return -(-value // step) * step


def _write_symbols(functions: Mapping[str, Iterable[str]]) -> None:
    head = SYMBOLS.read_text(encoding="ascii").splitlines()[0]
    lines = [line for soname in SONAMES for line in (soname, *(f"  {name}" for name in sorted(functions[soname])))]
    SYMBOLS.write_text("\n".join([head, *lines]) + "\n", encoding="ascii")


def main(arguments: list[str]) -> None:
    """Write every stand-in, after adding to the list what ``--list FOLDER`` needs."""
    functions = read_symbols()
    if arguments[:1] == ["--list"]:
        needed = imported_functions(shared_objects(Path(arguments[1])))
        _write_symbols({soname: {*functions[soname], *needed[soname]} for soname in SONAMES})
        functions = read_symbols()
    for soname in SONAMES:
        for machine in MACHINES:
            stub_path(soname, machine).write_bytes(stub(soname, functions[soname], machine))


if __name__ == "__main__":
    main(sys.argv[1:])
