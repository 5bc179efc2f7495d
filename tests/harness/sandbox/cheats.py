"""Attempts to cheat, each a function: it returns evidence when it works, or raises why it does not.

`cheat` selects one; its trial then fails with "it works: EVIDENCE", or with the reason why it did not work.
"""
import contextlib
import ctypes
import fcntl
import json
import mmap
import os
import pathlib
import socket
import subprocess
import sys
import time

import cheats_of_resources  # noqa: F401  registers its cheats
from cheating import CHEATS, call, cheat
from relign_bench.plugin import Optimizer, parameter, serve


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


@cheat
def leaves_a_hint(trial, secrets):
    """On how a file will be written; it stays with the file while it is in memory."""
    F_GET_RW_HINT = 1035
    with open(__file__) as file:
        return fcntl.fcntl(file, F_GET_RW_HINT, bytes(8))


@cheat
def marks_a_file(trial, secrets):
    """By a call of the file system, here for its attributes."""
    FS_IOC_GETFLAGS = 0x80086601
    with open(__file__) as file:
        return fcntl.ioctl(file, FS_IOC_GETFLAGS, bytes(8))


@cheat
def writes_out_all_files(trial, secrets):
    return call(162)  # sync, whose duration others can measure


@cheat
def takes_the_host_by_its_socket(trial, secrets):
    SO_PEERPIDFD = 77
    with socket.socket(fileno=os.dup(3)) as connection:
        return connection.getsockopt(socket.SOL_SOCKET, SO_PEERPIDFD)


class Cheats(Optimizer):
    observes = ["images", "merit", "start"]
    cheat = parameter("")
    secrets = parameter("{}", description="what an attacker knows or guesses, as JSON")

    def run(self, trial):
        evidence = CHEATS[self.cheat](trial, json.loads(self.secrets))
        raise RuntimeError(f"it works: {evidence}")


if __name__ == "__main__":
    serve(Cheats)
