"""BLAKE3 (O'Connor, Aumasson, Neves, Wilcox-O'Hearn 2020) of bytes, as the hash of a saved state asks for (clause K-3).

Python's library has none. This one is plain, a second for a third of a megabyte: states of solvers in Python are small.
"""

import struct

IV = (0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19)
ORDER = (2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8)
# Columns, then diagonals, of the state.
ROUND = ((0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15),
         (0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14))
CHUNK_START, CHUNK_END, PARENT, ROOT = 1, 2, 4, 8
BLOCK, CHUNK, MASK = 64, 1024, 0xFFFFFFFF


def _compress(chain, block, counter, flags):
    words = struct.unpack("<16I", block.ljust(BLOCK, b"\0"))
    s = [*chain, *IV[:4], counter & MASK, counter >> 32, len(block), flags]
    for turn in range(7):
        for k, (a, b, c, d) in enumerate(ROUND):
            for word, first, second in ((words[2 * k], 16, 12), (words[2 * k + 1], 8, 7)):
                s[a] = (s[a] + s[b] + word) & MASK
                mixed = s[d] ^ s[a]
                s[d] = (mixed >> first | mixed << (32 - first)) & MASK
                s[c] = (s[c] + s[d]) & MASK
                mixed = s[b] ^ s[c]
                s[b] = (mixed >> second | mixed << (32 - second)) & MASK
        words = tuple(words[i] for i in ORDER)
    return [s[i] ^ s[i + 8] for i in range(8)]


def _chunk(data, counter, flags):
    """The chaining value of at most 1024 bytes; `flags` are those of the last block besides."""
    chain, begins = IV, range(0, max(len(data), 1), BLOCK)
    for begin in begins:
        mark = (CHUNK_START if begin == 0 else 0) | (CHUNK_END | flags if begin == begins[-1] else 0)
        chain = _compress(chain, data[begin : begin + BLOCK], counter, mark)
    return chain


def _tree(data, counter, flags):
    """The chaining value of the tree whose left part is the largest power of two of chunks that leaves something right."""
    if len(data) <= CHUNK:
        return _chunk(data, counter, flags)
    left = 1 << ((len(data) - 1) // CHUNK).bit_length() - 1
    parts = _tree(data[: left * CHUNK], counter, 0) + _tree(data[left * CHUNK :], counter + left, 0)
    return _compress(IV, struct.pack("<16I", *parts), 0, PARENT | flags)


def digest(data):
    """The hash, 32 bytes."""
    return struct.pack("<8I", *_tree(data, 0, ROOT))
