"""Attempts to get more rights and resources than granted, to escape the limits, and to forge what the user is shown."""
import contextlib
import ctypes
import errno
import json
import mmap
import os
import resource
import signal
import socket
import tempfile
import threading
import time

from cheating import LIBC, call, cheat, in_child


# ---- more rights, more resources ------------------------------------------------------------------


@cheat
def makes_name_spaces(trial, secrets):
    CLONE_NEWUSER = 0x10000000
    return in_child(lambda: call(272, CLONE_NEWUSER))


@cheat
def mounts_a_file_system(trial, secrets):
    CLONE_NEWUSER, CLONE_NEWNS = 0x10000000, 0x20000
    text = ctypes.c_char_p(b"tmpfs")

    def mount():
        with contextlib.suppress(OSError):
            call(272, CLONE_NEWUSER | CLONE_NEWNS)
        call(165, text, ctypes.c_char_p(b"/tmp"), text, 0, 0)

    return in_child(mount)


@cheat
def makes_a_memory_file(trial, secrets):
    return os.memfd_create("out of sight")


@cheat
def uses_a_second_door(trial, secrets):
    """io_uring makes system calls that no filter sees."""
    return call(425, 1, ctypes.create_string_buffer(120))


@cheat
def fills_the_disk(trial, secrets):
    with tempfile.TemporaryFile() as file:
        for _ in range(300):
            file.write(bytes(1 << 20))
        file.flush()
    return "300 MiB"


@cheat
def forks_without_end(trial, secrets):
    end = time.monotonic() + 20
    while time.monotonic() < end:
        os.fork()


@cheat
def starts_threads_without_end(trial, secrets):
    threads = []
    while len(threads) < 4000:
        threads.append(threading.Thread(target=time.sleep, args=(20,), daemon=True))
        threads[-1].start()
    time.sleep(1)


@cheat
def blinds_the_watcher(trial, secrets):
    """Process 1 of the sandbox counts memory and processes; without file descriptors it could not."""
    return resource.prlimit(1, resource.RLIMIT_NOFILE, (0, 0))


@cheat
def slows_the_watcher(trial, secrets):
    for slow in (lambda: os.setpriority(os.PRIO_PROCESS, 1, 19),
                 lambda: os.setpriority(os.PRIO_USER, os.getuid(), 19),
                 lambda: os.sched_setaffinity(1, {0})):
        try:
            slow()
        except PermissionError as problem:
            reason = problem
        else:
            return "process 1 is slower"
    raise reason


@cheat
def enlarges_socket_buffers(trial, secrets):
    with socket.socket(socket.AF_UNIX) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 26)
    return "1 << 26 bytes asked for"


@cheat
def takes_memory_of_the_kernel(trial, secrets):
    """In the buffers of sockets, which belong to no process."""
    kept, size = [], 0
    for _ in range(3):
        os.fork()
    while len(kept) < 100:
        kept.append(socket.socketpair())
        for one in kept[-1]:
            one.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    size += one.send(bytes(32768))
    time.sleep(1)
    return f"{size} bytes"


@cheat
def takes_memory_of_page_tables(trial, secrets):
    """4 KiB for each 2 MiB of which a byte was read; the pages themselves are none."""
    kept, size = [], 1 << 30
    for _ in range(500):
        kept.append(mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=mmap.PROT_READ))
        kept[-1].madvise(mmap.MADV_NOHUGEPAGE)
        for place in range(0, size, 1 << 21):
            kept[-1][place]
    time.sleep(1)
    return "1 GB of page tables"


@cheat
def takes_memory_without_a_leader(trial, secrets):
    """In processes whose first thread has ended, so that their entries in /proc show no memory."""
    def hoard():
        kept = bytes(b"1") * (150 << 20)
        time.sleep(10)
        return kept

    for _ in range(2):
        if os.fork() == 0:
            threading.Thread(target=hoard).start()
            call(60, 0)  # exit, of this thread
    time.sleep(3)
    return "300 MB"


@cheat
def shares_memory_without_a_file(trial, secrets):
    """What a process has unmapped of it stays in memory, and counts for none."""
    return mmap.mmap(-1, 1 << 20)


@cheat
def maps_zeros(trial, secrets):
    with open("/dev/zero", "r+b", buffering=0) as zeros:
        return mmap.mmap(zeros.fileno(), 1 << 20)


@cheat
def lends_pages_to_pipes(trial, secrets):
    """By sendfile, splice, tee and vmsplice; they stay in the pipe or socket when no process has them."""
    page, (end, start) = ctypes.create_string_buffer(b"1", 4096), os.pipe()
    vector = (ctypes.c_size_t * 2)(ctypes.addressof(page), 1)
    source = os.open(__file__, os.O_RDONLY)
    for lend in (lambda: call(40, start, source, 0, 1), lambda: call(275, source, 0, start, 0, 1, 0),
                 lambda: call(276, end, start, 1, 0), lambda: call(278, start, vector, 1, 0)):
        try:
            return lend()
        except OSError as problem:
            reason = problem
            if problem.errno != errno.ENOSYS:
                raise
    raise reason


@cheat
def opens_many_files(trial, secrets):
    """A process could watch each pair of two (epoll), which takes memory of the kernel."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    return [os.open("/dev/null", os.O_RDONLY) for _ in range(400)][-1]


@cheat
def queues_signals(trial, secrets):
    """Each is memory of the kernel."""
    def queue():
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGRTMIN])
        for _ in range(400):
            if LIBC.sigqueue(os.getpid(), signal.SIGRTMIN, None) != 0:
                raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))

    return in_child(queue)


@cheat
def filters_its_own_calls(trial, secrets):
    """A filter is memory of the kernel, and each thread can have several."""
    PR_SET_NO_NEW_PRIVS, SECCOMP_SET_MODE_FILTER, SECCOMP_RET_ALLOW = 38, 1, 0x7FFF0000
    one = ctypes.create_string_buffer(b"\x06\0\0\0" + SECCOMP_RET_ALLOW.to_bytes(4, "little"), 8)
    program = (ctypes.c_size_t * 2)(1, ctypes.addressof(one))
    return in_child(lambda: (call(157, PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), call(317, SECCOMP_SET_MODE_FILTER, 0, program)))


@cheat
def has_a_real_time_priority(trial, secrets):
    """Its own or the operator's, so that process 1 would not come before it."""
    policy = os.sched_getscheduler(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        return f"policy {policy}"
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except PermissionError as problem:
        raise PermissionError(f"{problem}, policy {policy}") from None
    return "it can have one"


@cheat
def takes_all_memory(trial, secrets):
    taken = []
    while True:
        taken.append(bytes(1 << 24))


# ---- what the user is shown ------------------------------------------------------------------------


@cheat
def forges_the_end(trial, secrets):
    """The message and the exit status with which a sandbox ends a trial."""
    print("ended by the sandbox: 999 MB of memory", flush=True)
    os._exit(123)


@cheat
def mutes_the_watcher(trial, secrets):
    """Fills the pipe of its output, and does not let others wait for room in it."""
    os.set_blocking(2, False)
    for _ in range(70):
        if os.fork() == 0:
            break
    end = time.monotonic() + 10
    while time.monotonic() < end:
        with contextlib.suppress(BlockingIOError):
            os.write(2, b"." * 1000)


@cheat
def forges_lines(trial, secrets):
    """In its message, as if the harness had printed them."""
    os.write(3, json.dumps({"message": "failed", "text": "forged by the plugin:\nwarning: forged"}).encode() + b"\n")
    os._exit(1)
