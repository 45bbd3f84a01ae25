"""Makes fallback.png of GNU Unifont's glyphs:

    python3 fallback.py unifont.hex plane00-combining.txt DejaVuSans.ttf fallback.png

The first two are in Debian's package `unifont`. The picture has 256 × 256 cells of 16 × 16 pixels, a bit each; the cell of
U+xxyy is in row xx and column yy. Glyphs that DejaVu Sans has are left out, and those of private use. A black pixel is ink.
The last 2 × 16 lines are a bit a character: marks that go 8, and those that go 16 pixels back over the letter before them.
"""

import struct
import sys
import zlib


def covered(path):
    """The characters of a font's cmap (format 4)."""
    data = open(path, "rb").read()
    tables = {}
    for i in range(struct.unpack(">H", data[4:6])[0]):
        tag, _, offset, _ = struct.unpack(">4sIII", data[12 + 16 * i : 28 + 16 * i])
        tables[tag] = offset
    cmap, found = tables[b"cmap"], set()
    for i in range(struct.unpack(">H", data[cmap + 2 : cmap + 4])[0]):
        at = cmap + struct.unpack(">I", data[cmap + 8 + 8 * i : cmap + 12 + 8 * i])[0]
        if struct.unpack(">H", data[at : at + 2])[0] != 4:
            continue
        n = struct.unpack(">H", data[at + 6 : at + 8])[0] // 2
        ends = struct.unpack(f">{n}H", data[at + 14 : at + 14 + 2 * n])
        starts = struct.unpack(f">{n}H", data[at + 16 + 2 * n : at + 16 + 4 * n])
        for start, end in zip(starts, ends):
            found.update(range(start, end + 1))
    return found


def main(hexes, combining, dejavu, out):
    have = covered(dejavu)
    rows = [bytearray(512) for _ in range(4096 + 32)]
    for line in open(hexes):
        code, bits = line.strip().split(":")
        code = int(code, 16)
        if code > 0xFFFF or code in have or 0xD800 <= code < 0xF900 or code < 0x80:
            continue
        width = len(bits) // 32
        glyph = bytes.fromhex(bits)
        for y in range(16):
            row, at = rows[16 * (code >> 8) + y], 2 * (code & 0xFF)
            row[at : at + width] = glyph[width * y : width * (y + 1)]
    def chunk(tag, body):
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))

    header = struct.pack(">IIBBBBB", 4096, len(rows), 1, 0, 0, 0, 0)
    # 1 is white in a PNG; ink is black.
    for line in open(combining):
        code, offset = line.split(":")
        code = int(code, 16)
        rows[4096 + (16 if int(offset) < -12 else 0) + (code >> 12)][(code & 0xFFF) >> 3] |= 0x80 >> (code & 7)
    raw = b"".join(b"\0" + bytes(255 - b for b in row) for row in rows)
    png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")
    open(out, "wb").write(png)


if __name__ == "__main__":
    main(*sys.argv[1:])
