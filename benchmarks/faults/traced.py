"""A child whose system calls that change files are counted, and one of them met with a fault.

Linux on x86-64. The child asks the kernel (seccomp) to stop it before each such call, whichever
library makes it, and in whichever thread; its parent (ptrace) counts, and at the call of its choice
kills the child or answers with an error in the system's place.
"""

from __future__ import annotations

import ctypes
import os
import signal
import struct
from dataclasses import dataclass

#: The calls by their numbers on x86-64.
CALLS = {
    **{2: "open", 257: "openat", 85: "creat", 1: "write", 18: "pwrite64", 20: "writev"},
    **{296: "pwritev", 74: "fsync", 75: "fdatasync", 82: "rename", 264: "renameat"},
    **{316: "renameat2", 87: "unlink", 263: "unlinkat", 83: "mkdir", 258: "mkdirat", 84: "rmdir"},
    **{76: "truncate", 77: "ftruncate", 90: "chmod", 91: "fchmod", 268: "fchmodat", 86: "link"},
    **{88: "symlink", 40: "sendfile", 326: "copy_file_range", 285: "fallocate"},
}
#: Those that come in the hundreds and change only a file that has no name yet.
BULK = {"write", "pwrite64", "writev", "pwritev"}

_LIBC = ctypes.CDLL(None, use_errno=True)
_LIBC.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
_LIBC.ptrace.restype = ctypes.c_long
_TRACEME, _POKEUSER, _CONT, _SETOPTIONS = 0, 6, 7, 0x4200
_PEEKUSER = 3
#: Fork, vfork, clone, seccomp are reported; the child dies with its tracer.
_OPTIONS = 0x2 | 0x4 | 0x8 | 0x80 | 0x100000
_AT_SECCOMP = 7
_ANY_THREAD = 0x40000000
_RAX, _ORIG_RAX = 10 * 8, 15 * 8


@dataclass(frozen=True)
class Ended:
    """How a child ended.

    Attributes
    ----------
    calls : list of str
        What it asked of the system, until it ended.
    status : int
        Its exit status, or minus the signal that ended it.
    """

    calls: list[str]
    status: int


def run(at: int | None = None, error: int = 0, onward: bool = False) -> Ended | None:
    """Fork a child that is traced.

    Parameters
    ----------
    at : int, optional
        The call at which something happens, counted from 0.
    error : int
        The call is answered with this error; 0: the child is killed before it.
    onward : bool
        All later calls that write or make something are answered with it too, as by a full disk.

    Returns
    -------
    Ended or None
        None in the child, which goes on with its work.
    """
    child = os.fork()
    if child == 0:
        _be_traced()
        return None
    os.waitpid(child, 0)
    _ptrace(_SETOPTIONS, child, _OPTIONS)
    _ptrace(_CONT, child, 0)
    return _follow(child, at, error, onward)


def _follow(child: int, at: int | None, error: int, onward: bool) -> Ended:
    calls: list[str] = []
    while True:
        one, status = os.waitpid(-1, _ANY_THREAD)
        if not os.WIFSTOPPED(status):
            if one == child:
                return Ended(calls, os.waitstatus_to_exitcode(status))
            continue
        number, event = os.WSTOPSIG(status), status >> 16
        if event == _AT_SECCOMP:
            name = CALLS[_LIBC.ptrace(_PEEKUSER, one, _ORIG_RAX, None)]
            here = len(calls)
            calls.append(name)
            frees = name in ("unlink", "unlinkat", "rmdir")
            if at == here or (onward and at is not None and here > at and not frees):
                if not error:
                    os.kill(child, signal.SIGKILL)
                    continue
                _ptrace(_POKEUSER, one, ctypes.c_void_p(-error).value, _RAX)
                _ptrace(_POKEUSER, one, ctypes.c_void_p(-1).value, _ORIG_RAX)
        deliver = 0 if number in (signal.SIGTRAP, signal.SIGSTOP) else number
        _ptrace(_CONT, one, deliver)


def _ptrace(request: int, process: int, data: int | None, place: int = 0) -> None:
    _LIBC.ptrace(request, process, place, data)  # the child may be gone: waitpid tells


def _be_traced() -> None:
    _ptrace(_TRACEME, 0, 0)
    os.kill(os.getpid(), signal.SIGSTOP)
    steps = _filter()
    code = ctypes.create_string_buffer(steps, len(steps))
    program = ctypes.create_string_buffer(
        struct.pack("HxxxxxxP", len(steps) // 8, ctypes.addressof(code))
    )
    _LIBC.prctl(38, 1, 0, 0, 0)  # no new privileges
    if _LIBC.prctl(22, 2, program, 0, 0):
        raise OSError(ctypes.get_errno(), "no seccomp here")


def _filter() -> bytes:
    """A program of the kernel's filter: stop before the calls above, where they change a file."""
    load, same, has, at_least, give = 0x20, 0x15, 0x45, 0x35, 0x06
    allow, stop = 0x7FFF0000, 0x7FF00000
    creates, first = 0o1 | 0o2 | 0o100 | 0o1000, 3

    def step(code: int, yes: int, no: int, value: int) -> bytes:
        return struct.pack("HBBI", code, yes, no, value)

    out = b""
    writes = {1, 20, 18, 296}
    for number in sorted(set(CALLS) - writes - {2, 257}):
        out += step(load, 0, 0, 0) + step(same, 0, 1, number) + step(give, 0, 0, stop)
    for number in sorted(writes):  # of standard output and error only what stands behind a file
        out += step(load, 0, 0, 0) + step(same, 0, 3, number) + step(load, 0, 0, 16)
        out += step(at_least, 0, 1, first) + step(give, 0, 0, stop)
    for number, flags in ((2, 24), (257, 32)):
        out += step(load, 0, 0, 0) + step(same, 0, 3, number) + step(load, 0, 0, flags)
        out += step(has, 0, 1, creates) + step(give, 0, 0, stop)
    return out + step(give, 0, 0, allow)
