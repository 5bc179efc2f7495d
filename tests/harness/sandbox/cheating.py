"""What cheats have in common."""
import ctypes
import os

LIBC = ctypes.CDLL(None, use_errno=True)
CHEATS = {}


def cheat(function):
    CHEATS[function.__name__] = function
    return function


def call(number, *arguments):
    """A system call of x86-64 by its number."""
    result = LIBC.syscall(ctypes.c_long(number), *[ctypes.c_long(one) if isinstance(one, int) else one for one in arguments])
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def in_child(attempt):
    """For calls that a process with several threads cannot make."""
    child = os.fork()
    if child == 0:
        try:
            attempt()
            os._exit(0)
        except OSError as problem:
            os._exit(problem.errno)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code:
        raise OSError(code, os.strerror(code))
    return "done"
