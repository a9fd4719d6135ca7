"""Become a program under the filter that systemd would make of a unit; run as a program.

``python confine.py NAMES FAMILY COMMAND...``: of all system calls only those in NAMES (separated by
commas), sockets of one address family, and no memory that is both written and run, or made
executable later. All others are refused with EPERM (sockets: EAFNOSUPPORT), as in the unit.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import sys

_ALLOW, _ERRNO = 0x7FFF0000, 0x00050000  # SCMP_ACT_ALLOW, SCMP_ACT_ERRNO
_NOT_EQUAL, _MASKED_EQUAL = 1, 7  # SCMP_CMP_NE, SCMP_CMP_MASKED_EQ
_WRITE, _EXEC = 0x2, 0x4
_PROTECTION = 2
"""Which argument of mmap and mprotect it is."""


class _Compare(ctypes.Structure):
    """struct scmp_arg_cmp."""

    _fields_ = (
        ("arg", ctypes.c_uint),
        ("op", ctypes.c_int),
        ("datum_a", ctypes.c_uint64),
        ("datum_b", ctypes.c_uint64),
    )


def main(names: str, family: str, *command: str) -> None:
    """Load the filter and become the command."""
    lib = ctypes.CDLL("libseccomp.so.2", use_errno=True)
    lib.seccomp_init.restype = ctypes.c_void_p
    context = ctypes.c_void_p(lib.seccomp_init(ctypes.c_uint32(_ERRNO | errno.EPERM)))

    def add(action: int, name: str, *arguments: _Compare) -> None:
        number = lib.seccomp_syscall_resolve_name(name.encode("ascii"))
        if number < 0:
            return  # not of this processor
        array = (_Compare * max(1, len(arguments)))(*arguments)
        code = lib.seccomp_rule_add_array(
            context, ctypes.c_uint32(action), number, len(arguments), array
        )
        if code:
            raise OSError(-code, os.strerror(-code), name)

    protected = {"mmap", "mprotect", "pkey_mprotect", "socket"}
    for name in names.split(","):
        if name not in protected:
            add(_ALLOW, name)
    only = getattr(socket, family)
    add(_ALLOW, "socket", _Compare(0, 4, only, 0))  # SCMP_CMP_EQ
    add(_ERRNO | errno.EAFNOSUPPORT, "socket", _Compare(0, _NOT_EQUAL, only, 0))
    for bits in (0, _WRITE, _EXEC):
        add(_ALLOW, "mmap", _Compare(_PROTECTION, _MASKED_EQUAL, _WRITE | _EXEC, bits))
    for name in ("mprotect", "pkey_mprotect"):
        add(_ALLOW, name, _Compare(_PROTECTION, _MASKED_EQUAL, _EXEC, 0))
    code = lib.seccomp_load(context)
    if code:
        raise OSError(-code, os.strerror(-code))
    os.execv(command[0], command)  # noqa: S606 - a program becomes another one


if __name__ == "__main__":
    main(*sys.argv[1:])
