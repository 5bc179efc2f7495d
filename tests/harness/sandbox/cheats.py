"""Attempts to cheat, each a function: it returns evidence when it works, or raises why it does not.

`cheat` selects one; its trial then fails with "it works: EVIDENCE", or with the reason why it did not work.
"""
import contextlib
import ctypes
import ctypes.util
import fcntl
import json
import mmap
import os
import pathlib
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

from relign_bench.plugin import Optimizer, parameter, serve

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


def host_processes():
    """Processes of relign-bench that this one can see."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        if folder.name.isdigit() and int(folder.name) != os.getpid():
            with contextlib.suppress(OSError):
                own = folder.stat().st_uid == os.getuid()
                if own and b"relign-bench" in (folder / "cmdline").read_bytes():
                    found.append(int(folder.name))
    if not found:
        raise OSError("no process of relign-bench in sight")
    return found


# ---- the instance and its truth ---------------------------------------------------------------


@cheat
def runs_the_simulator(trial, secrets):
    listed = subprocess.run([secrets["program"], "list"], capture_output=True, text=True, check=True)
    return listed.stdout.splitlines()[0]


@cheat
def loads_the_scene(trial, secrets):
    return ctypes.CDLL(str(pathlib.Path(secrets["plugins"]) / "gaussian_spot/gaussian_spot.so"))


@cheat
def reads_the_scene_files(trial, secrets):
    return (pathlib.Path(secrets["plugins"]) / "lens_system/relign_od/lens.json").read_text()[:40]


@cheat
def reads_results(trial, secrets):
    return pathlib.Path(secrets["results"], "trials.jsonl").read_text()


@cheat
def reads_the_cache(trial, secrets):
    return pathlib.Path(secrets["cache"], "truth").read_text()


@cheat
def reads_the_journal(trial, secrets):
    """The files that the host has open."""
    for process in host_processes():
        for number in os.listdir(f"/proc/{process}/fd"):
            with open(f"/proc/{process}/fd/{number}", "rb") as file:
                return f"{process}/{number}: {file.name}"
    raise OSError("the host has no files open")


@cheat
def reads_host_memory(trial, secrets):
    host = pathlib.Path("/proc", str(host_processes()[0]))
    first = int((host / "maps").read_text().split("-")[0], 16)
    return os.pread(os.open(host / "mem", os.O_RDONLY), 16, first)


@cheat
def traces_the_host(trial, secrets):
    PTRACE_SEIZE = 0x4206
    return call(101, PTRACE_SEIZE, os.getppid(), 0, 0)


@cheat
def reads_memory_of_others(trial, secrets):
    return call(310, os.getppid(), 0, 0, 0, 0, 0)  # process_vm_readv


@cheat
def takes_files_of_others(trial, secrets):
    return call(438, call(434, os.getppid(), 0), 0, 0)  # pidfd_getfd of pidfd_open


@cheat
def inherits_files(trial, secrets):
    others = []
    for number in map(int, os.listdir("/proc/self/fd")):
        with contextlib.suppress(OSError):  # the list itself is closed again
            if number > 5 and not (name := os.readlink(f"/proc/self/fd/{number}")).startswith("/memfd:relign-pixels"):
                others.append(name)
    if not others:
        raise OSError("no other files are open")
    return others


@cheat
def reads_home(trial, secrets):
    return pathlib.Path(secrets["home"], "private").read_text()


@cheat
def follows_a_link(trial, secrets):
    """notes.py is a link from the plugin's folder to a file of the user."""
    return pathlib.Path(__file__).with_name("notes.py").read_text()


@cheat
def reads_the_environment(trial, secrets):
    return os.environ["RELIGN_TEST_SECRET"]


@cheat
def writes_the_shared_image(trial, secrets):
    pixels = os.open("/proc/self/fd/5", os.O_RDWR)
    with mmap.mmap(pixels, 4096) as image:
        image[:4] = b"\0\0\0\0"
    return "changed"


@cheat
def makes_more_steps(trial, secrets):
    seen = 0
    for _ in range(100):
        seen += trial.step([0.5] * len(trial.first.pose)) is not None
    if seen > trial.budget:
        return seen
    raise OSError(f"the host stopped it after {seen} steps")


# ---- help from outside ------------------------------------------------------------------------


@cheat
def uses_the_network(trial, secrets):
    with socket.create_connection(("127.0.0.1", secrets["port"]), timeout=5) as connection:
        return connection.recv(10)


@cheat
def uses_an_abstract_socket(trial, secrets):
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect("\0" + secrets["abstract"])
        return connection.recv(10)


@cheat
def uses_a_socket_file(trial, secrets):
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(secrets["socket"])
        return connection.recv(10)


@cheat
def asks_the_kernel_by_netlink(trial, secrets):
    return socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)


# ---- memory from trial to trial ---------------------------------------------------------------


def left_over(path):
    """True on the second call for the same path, if anything remains."""
    if path.exists():
        return f"{path} of an earlier trial"
    path.write_text("first trial")
    raise OSError("nothing remains of an earlier trial")


@cheat
def keeps_a_file(trial, secrets):
    return left_over(pathlib.Path("/tmp", secrets["name"]))


@cheat
def keeps_shared_memory(trial, secrets):
    return left_over(pathlib.Path("/dev/shm", secrets["name"]))


@cheat
def keeps_system_v_memory(trial, secrets):
    IPC_CREAT, IPC_EXCL = 0o1000, 0o2000
    try:
        call(29, secrets["key"], 4096, IPC_CREAT | IPC_EXCL | 0o600)
    except FileExistsError:
        IPC_RMID = 0
        call(31, call(29, secrets["key"], 4096, 0), IPC_RMID, 0)
        return "memory of an earlier trial"
    raise OSError("nothing remains of an earlier trial")


@cheat
def keeps_a_key(trial, secrets):
    KEY_SPEC_USER_KEYRING = -4
    name = ctypes.c_char_p(secrets["name"].encode())
    try:
        return call(250, 10, KEY_SPEC_USER_KEYRING, ctypes.c_char_p(b"user"), name, 0)  # keyctl(KEYCTL_SEARCH)
    except OSError as problem:
        if problem.errno != 126:  # ENOKEY
            raise
    call(248, ctypes.c_char_p(b"user"), name, ctypes.c_char_p(b"x"), 1, KEY_SPEC_USER_KEYRING)
    raise OSError("nothing remains of an earlier trial")


@cheat
def changes_its_own_code(trial, secrets):
    with open(__file__, "a"):
        return f"{__file__} can be written"


@cheat
def leaves_a_daemon(trial, secrets):
    """The test looks for the daemon after the trial."""
    command = f"import time; '{secrets['name']}'; time.sleep(600)"
    subprocess.Popen([sys.executable, "-c", command], start_new_session=True)
    raise OSError("the daemon runs")


@cheat
def hangs_with_a_daemon(trial, secrets):
    with contextlib.suppress(OSError):
        leaves_a_daemon(trial, secrets)
    while True:
        time.sleep(1)


@cheat
def locks_a_shared_file(trial, secrets):
    """Trials that run at the same time would meet at the lock."""
    with open(os.__file__) as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return os.__file__


@cheat
def watches_a_shared_file(trial, secrets):
    IN_OPEN = 0x20
    return call(254, call(294, 0), ctypes.c_char_p(os.__file__.encode()), IN_OPEN)


@cheat
def reads_the_machines_load(trial, secrets):
    """Processor time is a signal between trials, and shows how long the computation of the truth took."""
    return pathlib.Path("/proc/stat").read_text()[:40]


def usable_file():
    """A file that every sandbox shows."""
    return open(os.__file__, "rb")


@cheat
def reads_the_page_cache(trial, secrets):
    """Which pages of a shared file are in memory: a trial leaves a message by reading some of them."""
    with usable_file() as file:
        file.read(1)
        return os.preadv(file.fileno(), [bytearray(1)], 0, os.RWF_NOWAIT)


@cheat
def asks_for_pages_in_memory(trial, secrets):
    with usable_file() as file, mmap.mmap(file.fileno(), 4096, flags=mmap.MAP_PRIVATE) as page:
        return call(27, ctypes.addressof(ctypes.c_char.from_buffer(page)), 4096, ctypes.create_string_buffer(1))


@cheat
def empties_the_page_cache(trial, secrets):
    with usable_file() as file:
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    return "pages can be removed"


@cheat
def pages_out_a_file(trial, secrets):
    MADV_PAGEOUT = 21
    with usable_file() as file, mmap.mmap(file.fileno(), 4096, access=mmap.ACCESS_READ) as page:
        page.madvise(MADV_PAGEOUT)
    return "pages can be removed"


@cheat
def counts_the_machines_sockets(trial, secrets):
    SO_COOKIE = 57
    with socket.socket(socket.AF_UNIX) as one:
        return one.getsockopt(socket.SOL_SOCKET, SO_COOKIE, 8)


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
    while len(kept) < 400:
        kept.append(socket.socketpair())
        for one in kept[-1]:
            one.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    size += one.send(bytes(32768))
    time.sleep(1)
    return f"{size} bytes"


@cheat
def takes_all_memory(trial, secrets):
    taken = []
    while True:
        taken.append(bytes(1 << 24))


class Cheats(Optimizer):
    observes = ["images", "merit", "start"]
    cheat = parameter("")
    secrets = parameter("{}", description="what an attacker knows or guesses, as JSON")

    def run(self, trial):
        evidence = CHEATS[self.cheat](trial, json.loads(self.secrets))
        raise RuntimeError(f"it works: {evidence}")


if __name__ == "__main__":
    serve(Cheats)
