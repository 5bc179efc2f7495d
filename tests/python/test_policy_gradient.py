"""The example examples/policy_gradient: its gradient, its updates, resuming, and the network that it exports."""

import importlib.util
import json
import os
import pathlib
import subprocess
import tempfile
import unittest
from unittest import mock

from support import np, relign_bench

try:
    import torch
except ImportError:
    torch = None
try:
    import onnx
except ImportError:
    onnx = None

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "policy_gradient" / "train.py"


def load_example():
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("policy_gradient_train", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@unittest.skipIf(torch is None, "torch is not installed")
class PolicyGradient(unittest.TestCase):
    def setUp(self):
        torch.set_num_threads(1)
        torch.manual_seed(1)
        self.train = load_example()

    def small(self, slots):
        """A batch of small images, and a policy that moves."""
        batch = relign_bench.Batch(slots, "relign_od", "rho0.25", size=40, threads=1)
        batch.reset(range(slots), range(slots))
        policy = self.train.Policy(batch)
        torch.nn.init.normal_(policy.net.head.weight, std=0.1)
        return batch, policy

    def test_gradient_equals_differences_of_the_loss(self):
        batch, policy = self.small(2)
        # Near the optima the loss is steep, so that its noise matters less. With large weights and small moves a seventh of the
        # gradient passes through images to later moves.
        batch.move_by([0, 1], batch.nominal_pose + [[0.04], [-0.04]] - batch.true_poses([0, 1]))
        torch.nn.init.normal_(policy.net.head.weight, std=4)
        with torch.no_grad():
            images = torch.from_numpy(batch.render_at([0, 1], batch.true_poses([0, 1])))[:, None]
            policy.net.head.bias -= policy.net.along((images - policy.reference) * policy.unit).mean(dim=0)

        def loss():
            return self.train.rollout_loss(policy, batch, np.random.default_rng(1), moves=2, rays=1024)

        loss().backward()
        bias = policy.net.head.bias
        differences, step = [], 0.03
        with torch.no_grad():
            for axis in range(batch.axes):
                bias[axis] += step
                ahead = loss().item()
                bias[axis] -= 2 * step
                differences.append((ahead - loss().item()) / (2 * step))
                bias[axis] += step
        self.assertGreater(np.linalg.norm(differences), 1)
        error = np.linalg.norm(bias.grad.numpy() - differences) / np.linalg.norm(differences)
        self.assertLess(error, 0.06, (bias.grad, differences))

    def test_updates_reduce_the_loss(self):
        batch, policy = self.small(4)
        optimizer = torch.optim.Adam(policy.parameters(), lr=1e-3)
        losses = []
        for update in range(30):
            optimizer.zero_grad()
            loss = self.train.rollout_loss(policy, batch, np.random.default_rng(update), moves=2, rays=8)
            loss.backward()
            optimizer.step()
            losses.append(loss.item())
        self.assertLess(np.mean(losses[-3:]), np.mean(losses[:3]) - 0.3, losses)

    def test_resumed_run_continues_with_the_same_updates(self):
        found = {"score": 1.0, "rmse_6": 1.0, "rmse_12": 1.0}
        with tempfile.TemporaryDirectory() as scratch, mock.patch.object(self.train, "evaluate", return_value=found), \
                mock.patch.object(self.train.Training, "used", return_value=0.5), mock.patch.object(self.train, "SLOTS", 2):
            folder = pathlib.Path(scratch)
            whole = self.train.Training(folder, seed=3, minutes=1.0)
            whole.update()
            whole.check()
            whole.update()
            resumed = self.train.Training(folder, seed=3, minutes=1.0)
            self.assertEqual((resumed.updates, resumed.before), (1, 0.5))
            resumed.update()
            for name, value in whole.policy.state_dict().items():
                self.assertTrue(torch.equal(value, resumed.policy.state_dict()[name]), name)
            with self.assertRaisesRegex(SystemExit, "has a run with seed 3"):
                self.train.Training(folder, seed=4, minutes=1.0)

    @unittest.skipIf(onnx is None, "onnx is not installed")
    def test_program_runs_the_exported_network(self):
        batch = relign_bench.Batch(1, self.train.SCENE, "rho0.25", size=self.train.SIZE, threads=1)
        policy = self.train.Policy(batch)
        torch.nn.init.normal_(policy.net.head.weight, std=0.1)
        state = {"seed": 1, "minutes": 1.0, "updates": 0, "spent": 0.0}
        with tempfile.TemporaryDirectory() as scratch:
            self.train.write(policy, pathlib.Path(scratch) / "policy", state, "none")
            # The program compares 64 outputs with those of torch, in the side file, before it runs a network.
            done = subprocess.run([os.environ["RELIGN_PROGRAM"], "try", f"{scratch}/policy.json", "--noise-level", "rho0.25",
                                   "--steps", "2", "--json"], text=True, check=False, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        poses = [step["commanded_pose"] for step in json.loads(done.stdout)["steps"]]
        self.assertEqual(len(poses), 3)
        self.assertGreater(np.abs(np.subtract(poses[1], poses[0])).max(), 1e-3)


if __name__ == "__main__":
    unittest.main()
