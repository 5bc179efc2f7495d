"""Derivatives of images by the pose from Python, and PyTorch's gradients through them."""

import unittest

from support import np, relign_bench

try:
    import torch
except ImportError:
    torch = None
try:
    import jax
except ImportError:
    jax = None

SEEDS = [11, 12]


class Derivatives(unittest.TestCase):
    def setUp(self):
        self.batch = relign_bench.Batch(2, "relign_od", "rho0.5", size=40, threads=1)
        self.batch.reset([0, 1], [3, 4])
        self.poses = np.clip(self.batch.nominal_pose + [[0.03], [-0.04]], 0, 1)

    def test_equal_differences_of_noise_free_images(self):
        _, slopes = self.batch.derivatives_at([0, 1], self.poses, SEEDS, samples=4096)
        self.assertEqual(slopes.shape, (2, 5, 40, 40))
        step = 0.006
        for axis in range(5):
            ahead, behind = self.poses.copy(), self.poses.copy()
            ahead[:, axis] += step
            behind[:, axis] -= step
            difference = (self.batch.render_at([0, 1], ahead) - self.batch.render_at([0, 1], behind)) / (2 * step)
            for slot in range(2):
                # The difference has the noise of two images, so it is projected on the slope. Focus changes the image least.
                slope = slopes[slot, axis]
                projected = np.vdot(slope, difference[slot]) / np.vdot(slope, slope)
                self.assertAlmostEqual(projected, 1, delta=0.15 if axis == 2 else 0.05, msg=(slot, axis))

    def test_image_is_that_of_the_pose_and_seeds_are_independent(self):
        images, _ = self.batch.derivatives_at([0, 1], self.poses, SEEDS, samples=1024)
        noise_free = self.batch.render_at([0, 1], self.poses)
        self.assertLess(np.abs(images - noise_free).mean(), 0.02 * self.batch.white)
        again, _ = self.batch.derivatives_at([1, 0], self.poses[::-1], SEEDS[::-1], samples=1024)
        self.assertTrue(np.array_equal(again[::-1], images))
        other, _ = self.batch.derivatives_at([0, 1], self.poses, [1, 2], samples=1024)
        self.assertFalse(np.array_equal(other, images))

    def test_mistakes(self):
        for arguments, message in (
            (([0, 1], self.poses, SEEDS, 0), "samples"),
            (([0, 1], self.poses, SEEDS[:1]), "one seed per slot"),
            (([0, 1], self.poses + 1, SEEDS), "outside"),
            (([0], self.poses, SEEDS[:1]), "poses"),
        ):
            with self.subTest(message=message), self.assertRaisesRegex(ValueError, message):
                self.batch.derivatives_at(*arguments)
        spot = relign_bench.Batch(1, "gaussian_spot", "rho0")
        spot.reset([0], [0])
        with self.assertRaisesRegex(ValueError, "scene 'gaussian_spot' has no derivatives"):
            spot.derivatives_at([0], [[0.5] * 5], [1])

    @unittest.skipIf(jax is None, "jax is not installed")
    def test_jax_takes_images_and_derivatives_by_dlpack(self):
        images, slopes = self.batch.derivatives_at([0, 1], self.poses, SEEDS)
        for array in (images, slopes, self.batch.reference):
            taken = jax.dlpack.from_dlpack(array)
            self.assertIsInstance(taken, jax.Array)
            self.assertTrue(np.array_equal(np.asarray(taken), array))
        # The gradient of a squared error by the poses, as docs/derivatives.md has it.
        reference = jax.numpy.asarray(self.batch.reference)
        gradient = jax.grad(lambda seen: ((seen - reference) ** 2).mean())(jax.dlpack.from_dlpack(images))
        by_pose = jax.numpy.einsum("nhw,nahw->na", gradient, jax.dlpack.from_dlpack(slopes))
        expected = np.einsum("nhw,nahw->na", 2 * (images - self.batch.reference) / images.size, slopes)
        np.testing.assert_allclose(by_pose, expected, rtol=1e-3, atol=1e-5 * np.abs(expected).max())
        self.assertEqual(jax.numpy.asarray(self.batch.frames).shape, (2, 40, 40))  # read-only, so a copy


@unittest.skipIf(torch is None, "torch is not installed")
class Gradients(unittest.TestCase):
    def setUp(self):
        self.batch = relign_bench.Batch(2, "relign_od", "rho0.5", size=40, threads=1)
        self.batch.reset([0, 1], [3, 4])

    def test_gradient_of_a_weighted_sum_is_the_product_with_the_derivatives(self):
        from relign_bench.differentiable import render

        poses = torch.tensor(np.tile(self.batch.nominal_pose, (2, 1)), requires_grad=True)
        weights = torch.randn(2, 40, 40, generator=torch.Generator().manual_seed(1))
        (render(self.batch, [0, 1], poses, SEEDS) * weights).sum().backward()
        _, slopes = self.batch.derivatives_at([0, 1], poses.detach().numpy(), SEEDS)
        np.testing.assert_allclose(poses.grad, np.einsum("nhw,nahw->na", weights.numpy(), slopes), rtol=1e-4)

    def test_descent_aligns_a_lens(self):
        from relign_bench.differentiable import render

        reference = torch.from_numpy(self.batch.reference)
        optima = np.array([pose for pose, _ in self.batch.optima([0, 1])])
        poses = torch.tensor(np.clip(optima + [[0.03], [-0.03]], 0, 1), requires_grad=True)
        optimizer = torch.optim.Adam([poses], lr=0.02)
        losses = []
        for step in range(60):
            optimizer.zero_grad()
            loss = ((render(self.batch, [0, 1], poses, [2 * step, 2 * step + 1], 32) - reference) ** 2).mean(dim=(1, 2))
            losses.append(loss.detach().numpy())
            loss.sum().backward()
            optimizer.step()
            with torch.no_grad():
                poses.clamp_(0, 1)
        before, after = np.mean(losses[:3], axis=0), np.mean(losses[-3:], axis=0)
        self.assertTrue((after < 0.35 * before).all(), (before, after))


if __name__ == "__main__":
    unittest.main()
