"""A line that can be cut: passes connections from one port on to another.

Run: python benchmarks/study/network.py FROM TO, and kill it to cut every connection.
"""

from __future__ import annotations

import asyncio
import sys


async def pass_on(source: asyncio.StreamReader, to: asyncio.StreamWriter) -> None:
    """One direction of one connection."""
    try:
        while block := await source.read(1 << 16):
            to.write(block)
            await to.drain()
    except ConnectionError:
        pass
    finally:
        to.close()


async def serve(port: int, behind: int) -> None:
    """Take connections for ever."""

    async def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            there, back = await asyncio.open_connection("127.0.0.1", behind)
        except OSError:
            writer.close()
            return
        await asyncio.gather(pass_on(reader, back), pass_on(there, writer))

    async with await asyncio.start_server(connected, "127.0.0.1", port) as server:
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(serve(int(sys.argv[1]), int(sys.argv[2])))
