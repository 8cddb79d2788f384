"""Compressed data of a file, unpacked to no more than is allowed."""

import zlib


def unpack(data: bytes, most: int) -> bytes:
    """Unpack what `zlib.compress` has made.

    Parameters
    ----------
    data : compressed; a few kB of a damaged or hostile file may stand for gigabytes
    most : size that is allowed [bytes]

    Raises
    ------
    ValueError
        The data are cut short, or larger than allowed.
    zlib.error
        They are not compressed data.
    """
    unpacker = zlib.decompressobj()
    found = unpacker.decompress(data, most + 1)
    if len(found) > most or not unpacker.eof:
        raise ValueError(f"its compressed data are cut short, or unpack to more than {most} bytes")
    return found
