"""`--sandbox`: results are those of an ordinary run, cheats fail, and docs/sandbox.md lists them.

Each cheat of cheats.py runs in an ordinary trial and in a sandbox. Skipped where the system allows no sandbox."""

import contextlib
import json
import os
import pathlib
import re
import socket
import subprocess
import tempfile
import threading
import time
import unittest
import uuid

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
PROGRAM = pathlib.Path(os.environ["RELIGN_BENCH"])
BUILD = PROGRAM.parents[1]
SCENE = ["--scene", "gaussian_spot", "--noise-level", "none", "--steps", "4"]

# Why each cheat fails in a sandbox; with "twice" the second of two trials counts, with "sandbox only" it would harm the
# machine in an ordinary trial.
MISSING, DENIED, FORBIDDEN = "No such file or directory", "Permission denied", "Operation not permitted"
ENDED = "its process was ended by the sandbox: "
EXPECTED = {
    "runs_the_simulator": MISSING,
    "loads_the_scene": "cannot open shared object file",
    "reads_the_scene_files": MISSING,
    "reads_results": MISSING,
    "reads_the_cache": MISSING,
    "reads_the_journal": "no process of relign-bench in sight|" + DENIED,
    "reads_host_memory": "no process of relign-bench in sight|" + DENIED,
    "traces_the_host": FORBIDDEN,
    "reads_memory_of_others": FORBIDDEN,
    "takes_files_of_others": "Function not implemented",
    "inherits_files": "no other files are open",
    "reads_home": MISSING,
    "follows_a_link": MISSING,
    "reads_the_environment": "RELIGN_TEST_SECRET",
    "writes_the_shared_image": FORBIDDEN,
    "makes_more_steps": "the host stopped it after 4 steps",
    "uses_the_network": DENIED,
    "uses_an_abstract_socket": "Connection refused",
    "uses_a_socket_file": MISSING,
    "asks_the_kernel_by_netlink": DENIED,
    "keeps_a_file": "nothing remains",
    "keeps_shared_memory": "nothing remains",
    "keeps_system_v_memory": FORBIDDEN,
    "keeps_a_key": FORBIDDEN,
    "changes_its_own_code": "Read-only file system",
    "leaves_a_daemon": "the daemon runs",
    "locks_a_shared_file": FORBIDDEN,
    "watches_a_shared_file": FORBIDDEN,
    "reads_the_machines_load": MISSING,
    "reads_the_page_cache": "Operation not supported",
    "asks_for_pages_in_memory": FORBIDDEN,
    "empties_the_page_cache": FORBIDDEN,
    "pages_out_a_file": FORBIDDEN,
    "counts_the_machines_sockets": "Protocol not available",
    "blinds_the_watcher": FORBIDDEN,
    "slows_the_watcher": FORBIDDEN,
    "enlarges_socket_buffers": FORBIDDEN,
    "makes_name_spaces": FORBIDDEN,
    "mounts_a_file_system": FORBIDDEN,
    "makes_a_memory_file": FORBIDDEN,
    "uses_a_second_door": "Function not implemented",
    "fills_the_disk": "No space left on device|File too large",
    "leaves_a_hint": "No locks available",
    "marks_a_file": "Inappropriate ioctl",
    "writes_out_all_files": FORBIDDEN,
    "takes_the_host_by_its_socket": "Protocol not available",
    "shares_memory_without_a_file": FORBIDDEN,
    "maps_zeros": MISSING,
    "lends_pages_to_pipes": "Function not implemented",
    "opens_many_files": "Too many open files",
    "queues_signals": "Resource temporarily unavailable",
    "filters_its_own_calls": FORBIDDEN,
    "has_a_real_time_priority": FORBIDDEN,
    "forges_the_end": r"ended with exit status 1; its last output:\n  ended by the sandbox: 999 MB",
    "forges_lines": r"forged by the plugin:\n  warning: forged",
    "mutes_the_watcher": ENDED + "more than 64 processes",
    "forks_without_end": ENDED + "more than 64 processes",
    "starts_threads_without_end": ENDED + "more than 1024 threads|can't start new thread",
    "takes_all_memory": "MemoryError|" + ENDED + r"\d+ MB of memory",
    "takes_memory_of_the_kernel": ENDED + r"\d+ MB of memory; at most 200 MB are allowed",
    "takes_memory_of_page_tables": ENDED + r"\d+ MB of memory",
    "takes_memory_without_a_leader": ENDED + r"\d+ MB of memory",
}
# Need the limit of a suite in MB.
MEMORY_LIMITS = {"takes_all_memory": 500, "takes_memory_of_the_kernel": 200, "takes_memory_of_page_tables": 200,
                 "takes_memory_without_a_leader": 200}
TWICE = {"keeps_a_file", "keeps_shared_memory", "keeps_system_v_memory", "keeps_a_key"}
SANDBOX_ONLY = {"forks_without_end", "starts_threads_without_end", "blinds_the_watcher", "slows_the_watcher",
                "mutes_the_watcher", "writes_out_all_files", *MEMORY_LIMITS}
# Refused in ordinary trials as well, by the host or by some systems (ptrace_scope of Yama, disabled user namespaces).
REFUSED_ANYWAY = {"makes_more_steps", "inherits_files", "leaves_a_daemon", "forges_the_end", "forges_lines"}
DEPENDS_ON_SYSTEM = {"reads_host_memory", "traces_the_host", "reads_memory_of_others", "takes_files_of_others",
                     "makes_name_spaces", "mounts_a_file_system", "uses_a_second_door", "keeps_a_key", "marks_a_file",
                     "takes_the_host_by_its_socket", "has_a_real_time_priority"}


def run(*words, **environment):
    result = subprocess.run([str(PROGRAM), *map(str, words)], capture_output=True, text=True, timeout=300,
                            env={**os.environ, **environment})
    return result.returncode, result.stdout + result.stderr


def copy_of_cheats(folder):
    for file in HERE.glob("cheat*.py"):
        (folder / file.name).write_text(file.read_text())
    return folder / "cheats.py"


def why_not():
    _, text = run("doctor", "--json")
    finding = next(one for one in json.loads(text[: text.rindex("]") + 1]) if one["what"] == "sandbox")
    return "" if finding["state"] == "ok" else finding["found"]


PROBLEM = why_not()


def lines_of(results):
    return [line for file in sorted(pathlib.Path(results, "trials").iterdir()) for line in file.read_text().splitlines()]


class Server:
    """Answers every connection, at all addresses that a plugin may try."""

    def __init__(self, folder):
        self.abstract, self.path = f"relign-{uuid.uuid4()}", str(folder / "socket")
        self.sockets = []
        for family, address in ((socket.AF_INET, ("127.0.0.1", 0)), (socket.AF_UNIX, "\0" + self.abstract),
                                (socket.AF_UNIX, self.path)):
            listener = socket.socket(family)
            listener.bind(address)
            listener.listen()
            self.sockets.append(listener)
            threading.Thread(target=self.serve, args=(listener,), daemon=True).start()
        self.port = self.sockets[0].getsockname()[1]

    def serve(self, listener):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = listener.accept()
                connection.sendall(b"the truth")
                connection.close()

    def close(self):
        for listener in self.sockets:
            listener.close()


@unittest.skipIf(PROBLEM, PROBLEM)
class TestCheats(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        root = pathlib.Path(cls.folder.name)
        for folder in ("results", "cache", "home", "plugin"):
            (root / folder).mkdir()
        (root / "results/trials.jsonl").write_text("the truth")
        (root / "cache/truth").write_text("the truth")
        (root / "home/private").write_text("a secret")
        cls.plugin = copy_of_cheats(root / "plugin")
        (root / "plugin/notes.py").symlink_to(root / "home/private")
        cls.server = Server(root)
        cls.secrets = {"program": str(PROGRAM), "plugins": str(BUILD / "lib/relign-bench/plugins"),
                       "results": str(root / "results"), "cache": str(root / "cache"), "home": str(root / "home"),
                       "port": cls.server.port, "abstract": cls.server.abstract, "socket": cls.server.path}

    @classmethod
    def tearDownClass(cls):
        cls.server.close()
        cls.folder.cleanup()

    def attempt(self, cheat, *options):
        name = f"relign-test-{uuid.uuid4()}"
        key = uuid.uuid4().int % 2**31
        parameters = {"cheat": cheat, "secrets": json.dumps({**self.secrets, "name": name, "key": key})}
        words = ["try", self.plugin, "--parameters", json.dumps(parameters), *SCENE, *options]
        for _ in range(2 if cheat in TWICE else 1):
            code, text = run(*words, RELIGN_TEST_SECRET="a secret")
        self.assertNotEqual(code, 0, text)
        for leftover in (pathlib.Path("/tmp", name), pathlib.Path("/dev/shm", name)):
            leftover.unlink(missing_ok=True)
        daemons = [folder for folder in pathlib.Path("/proc").iterdir()
                   if folder.name.isdigit() and self.has_name(folder, name)]
        self.assertEqual(daemons, [], "a process outlived its trial")
        return text

    @staticmethod
    def has_name(folder, name):
        with contextlib.suppress(OSError):
            return name.encode() in (folder / "cmdline").read_bytes() and int(folder.name) != os.getpid()
        return False

    def test_fail_in_sandbox_with_reason(self):
        for cheat, reason in EXPECTED.items():
            with self.subTest(cheat=cheat):
                if cheat in MEMORY_LIMITS:
                    continue  # below
                text = self.attempt(cheat, "--sandbox")
                self.assertNotIn("it works", text)
                self.assertRegex(text, reason)

    def test_work_in_ordinary_trial(self):
        for cheat in EXPECTED.keys() - SANDBOX_ONLY - DEPENDS_ON_SYSTEM:
            with self.subTest(cheat=cheat):
                text = self.attempt(cheat)
                if cheat in REFUSED_ANYWAY:
                    self.assertNotIn("it works", text)
                else:
                    self.assertIn("it works", text)

    def test_memory_limit_of_suite(self):
        for cheat, megabytes in MEMORY_LIMITS.items():
            with self.subTest(cheat=cheat), tempfile.TemporaryDirectory() as folder:
                suite = pathlib.Path(folder, "suite.json")
                entry = {"use": str(self.plugin), "name": "hog", "parameters": {"cheat": cheat}}
                suite.write_text(json.dumps({"name": "hog", "scenes": ["gaussian_spot"], "noise_levels": ["none"],
                                             "algorithms": [entry], "instances": 1, "steps": 2,
                                             "trial_memory_mb": megabytes}))
                _, text = run("run", suite, "--out", f"{folder}/results", "--sandbox", "--workers", 1)
                self.assertNotIn("it works", text)
                self.assertRegex(text, EXPECTED[cheat])

    def test_policy_is_the_operators_but_never_a_real_time_one(self):
        for operators, priority, plugins in ((os.SCHED_BATCH, 0, os.SCHED_BATCH), (os.SCHED_RR, 1, os.SCHED_OTHER)):
            with self.subTest(operators=operators):
                try:
                    os.sched_setscheduler(0, operators, os.sched_param(priority))
                except PermissionError as problem:
                    self.skipTest(f"a real-time policy: {problem}")
                try:
                    text = self.attempt("has_a_real_time_priority", "--sandbox")
                finally:
                    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
                self.assertIn(f"{FORBIDDEN}, policy {plugins}", text)

    def test_scene_is_not_in_process_of_library(self):
        words = ["try", BUILD / "tests/harness/sandbox/plugins/library_cheat", *SCENE]
        self.assertIn("it works", run(*words)[1])
        self.assertIn("the scene's code is not in this process", run(*words, "--sandbox")[1])

    def test_code_that_runs_for_a_manifest_is_confined(self):
        with tempfile.TemporaryDirectory() as folder:
            (target := pathlib.Path(folder, "out")).mkdir()
            script = pathlib.Path(folder, "plugin.py")
            text = f"open({str(target / 'written')!r}, 'w')\n" + (HERE / "cheats.py").read_text()
            script.write_text(text)
            code, printed = run("try", script, *SCENE, "--sandbox")
            self.assertNotEqual(code, 0)
            self.assertIn(MISSING, printed)
            self.assertEqual(list(target.iterdir()), [])

    def test_results_folder_inside_plugin_folder_is_hidden(self):
        with tempfile.TemporaryDirectory() as folder:
            plugin = pathlib.Path(folder)
            (plugin / "relign-plugin.json").write_text(json.dumps(
                {"id": "lister", "kind": "optimizer", "summary": "Lists the results.",
                 "command": ["sh", "-c", f"ls -A {folder} {folder}/results; exit 3"]}))
            suite = plugin / "suite.json"
            suite.write_text(json.dumps({"name": "lister", "scenes": ["gaussian_spot"], "noise_levels": ["none"],
                                         "algorithms": [folder], "instances": 1, "steps": 2}))
            _, text = run("run", suite, "--out", plugin / "results", "--sandbox")
            self.assertIn("relign-plugin.json", text)
            self.assertNotIn("manifest.json", text)

    def test_document_lists_every_cheat(self):
        document = (ROOT / "docs/sandbox.md").read_text()
        listed = set(re.findall(r"^\| `(\w+)`", document, re.MULTILINE))
        self.assertEqual(listed, set(EXPECTED) | {"library_cheat"})


@unittest.skipIf(PROBLEM, PROBLEM)
class TestRuns(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name)
        cls.suite = cls.root / "suite.json"
        cls.suite.write_text(json.dumps({
            "name": "sandbox", "scenes": ["gaussian_spot"], "noise_levels": ["none"], "instances": 2, "steps": 12,
            "algorithms": ["nlopt-bobyqa", "cma-es-then-bobyqa", "transfer-gp",
                           str(ROOT / "examples/compass_python/compass.py")]}))
        cls.printed = {}
        for name, options in (("plain", []), ("sandbox", ["--sandbox"])):
            code, cls.printed[name] = run("run", cls.suite, "--out", cls.root / name, *options)
            if code != 0:
                raise AssertionError(cls.printed[name])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_records_are_equal_byte_for_byte(self):
        self.assertEqual(lines_of(self.root / "plain"), lines_of(self.root / "sandbox"))

    def test_manifest_states_sandbox(self):
        plain, confined = (json.loads((self.root / name / "manifest.json").read_text()) for name in ("plain", "sandbox"))
        self.assertNotIn("sandbox", plain)
        self.assertEqual((confined["sandbox"]["processes"], confined["sandbox"]["shown"]), (64, []))

    def test_refuses_mixed_folder(self):
        code, text = run("run", self.suite, "--out", self.root / "plain", "--sandbox")
        self.assertEqual(code, 2)
        self.assertIn("ran without a sandbox", text)

    def test_replay_in_sandbox_is_equal(self):
        code, text = run("verify", self.root / "sandbox", "--sandbox")
        self.assertEqual(code, 0, text)
        self.assertIn("the results are reproduced", text)

    def test_replay_without_sandbox_needs_consent(self):
        code, text = run("verify", self.root / "sandbox")
        self.assertEqual(code, 2, text)
        self.assertIn("ran in a sandbox; replay them with --sandbox, or with --no-sandbox", text)
        code, text = run("verify", self.root / "sandbox", "--no-sandbox", "--sample", 1)
        self.assertEqual(code, 0, text)

    def test_plan_confines_code_that_runs_for_a_manifest(self):
        script = self.root / "acts.py"
        (target := self.root / "out").mkdir()
        script.write_text(f"open({str(target / 'written')!r}, 'w')\n" + (HERE / "cheats.py").read_text())
        suite = self.root / "acts.json"
        suite.write_text(json.dumps({"name": "acts", "scenes": ["gaussian_spot"], "noise_levels": ["none"],
                                     "algorithms": [str(script)], "instances": 1, "steps": 2}))
        code, text = run("plan", suite, "-o", self.root / "plan.json", "--sandbox")
        self.assertNotEqual(code, 0)
        self.assertIn(MISSING, text)
        self.assertEqual(list(target.iterdir()), [])
        code, text = run("plan", self.suite, "-o", self.root / "plan.json", "--sandbox")
        self.assertEqual(code, 0, text)
        self.assertIn("--shard 0/1 --sandbox", text)

    def test_merged_folder_is_not_called_sandboxed_if_one_was_not(self):
        code, text = run("merge", self.root / "plain", self.root / "sandbox", "-o", self.root / "merged")
        self.assertEqual(code, 0, text)
        self.assertIn("ran in a sandbox in 1 of 2 folders", text)
        manifest = json.loads((self.root / "merged/manifest.json").read_text())
        self.assertNotIn("sandbox", manifest)
        self.assertEqual(["sandbox" in source for source in manifest["sources"]], [False, True])

    def test_services_of_library_give_equal_steps(self):
        for plugin in ("services_example", "service_user"):
            with self.subTest(plugin=plugin):
                words = ["try", BUILD / "tests/harness/trials/plugins" / plugin, "--scene", "gaussian_spot",
                         "--noise-level", "none", "--steps", "6"]
                plain, confined = run(*words), run(*words, "--sandbox")
                without_times = [re.sub(r"; its process.*", "", text, flags=re.DOTALL) for _, text in (plain, confined)]
                self.assertEqual(*without_times)

    def test_regions_of_library_give_equal_steps(self):
        script = [["select", [[60, 60, 50, 40], [100, 90, 70, 60]]], ["step", [0.5] * 5], ["measure", "mean"],
                  ["select", [[0, 0, 201, 1]]], ["step", [0.51] * 5]]
        words = ["try", BUILD / "tests/harness/trials/plugins/service_user", "--scene", "relign_od", "--noise-level", "none",
                 "--steps", "2", "--parameters", json.dumps({"script": script})]
        plain, confined = run(*words), run(*words, "--sandbox")
        self.assertEqual(plain[0], 0, plain[1])
        self.assertRegex(plain[1], r"\n +1 .* regions ")
        self.assertIn("200 columns", plain[1])
        self.assertEqual(plain, confined)

    def test_shows_what_it_is_asked_to(self):
        data = self.root / "data.txt"
        data.write_text("granted")
        plugin = self.root / "reader.py"
        plugin.write_text("from relign_bench.plugin import Optimizer, serve\n\n\nclass Reader(Optimizer):\n"
                          f"    'Reads a file.'\n\n    def run(self, trial):\n        print(open({str(data)!r}).read())\n\n\n"
                          "serve(Reader)\n")
        self.assertIn(MISSING, run("try", plugin, *SCENE, "--sandbox")[1])
        self.assertIn("granted", run("try", plugin, *SCENE, "--sandbox", "--sandbox-show", data)[1])
        code, text = run("try", plugin, *SCENE, "--sandbox", "--sandbox-show", "/")
        self.assertNotEqual(code, 0)
        self.assertIn("which is the whole system", text)

    def test_daemon_does_not_outlive_run(self):
        name = f"relign-test-{uuid.uuid4()}"
        plugin = copy_of_cheats(self.root)
        for cheat, options in (("leaves_a_daemon", []), ("hangs_with_a_daemon", []),
                               ("hangs_with_a_daemon", ["--sandbox"])):
            with self.subTest(cheat=cheat, options=options):
                parameters = {"cheat": cheat, "secrets": json.dumps({"name": name})}
                entry = {"use": str(plugin), "name": "cheat", "parameters": parameters}
                suite = self.root / "daemon.json"
                suite.write_text(json.dumps({"name": "daemon", "scenes": ["gaussian_spot"], "noise_levels": ["none"],
                                             "algorithms": [entry], "instances": 1, "steps": 2, "trial_seconds": 3}))
                _, text = run("run", suite, "--out", self.root / f"daemon-{cheat}-{len(options)}", *options)
                self.assertIn("took longer than 3 s" if "hangs" in cheat else "the daemon runs", text)
                time.sleep(0.2)
                left = [folder for folder in pathlib.Path("/proc").iterdir()
                        if folder.name.isdigit() and TestCheats.has_name(folder, name)]
                self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
