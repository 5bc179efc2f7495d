"""The compiled layers of the paper's network, against the definition in double precision."""

import unittest

from support import np

from relign_bench import _native

PooledConvolution = _native._core.PooledConvolution


def convolved(images, weights, bias):
    """3 x 3, stride 2, padded by 1; shape (images, out_channels, rows, columns)."""
    padded = np.pad(images.astype(np.float64), ((0, 0), (0, 0), (1, 1), (1, 1)))
    patches = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(2, 3))[:, :, ::2, ::2]
    return np.einsum("ncyxij,ocij->noyx", patches, weights.astype(np.float64)) + bias[:, None, None]


def pooled(values):
    rows, columns = values.shape[2] // 2, values.shape[3] // 2
    blocks = values[:, :, : 2 * rows, : 2 * columns].reshape(*values.shape[:2], rows, 2, columns, 2)
    return np.maximum(blocks.max(axis=(3, 5)), 0)


def last(images):
    """A view with the channels last."""
    return images.transpose(0, 2, 3, 1)


def first(images):
    return images.transpose(0, 3, 1, 2)


def forward(layer, images, weights, bias):
    shape = (len(images), (images.shape[2] + 1) // 4, (images.shape[3] + 1) // 4, len(weights))
    out, places = np.full(shape, 7, np.float32), np.full(shape, 7, np.uint8)
    layer.forward(last(images), weights, bias, out, places)
    return first(out), first(places)


def backward(layer, images, weights, gradient, places):
    of_images = np.full_like(last(images), 7, order="C")
    found = [np.full_like(weights, 7), np.full(len(weights), 7, np.float32)]
    layer.backward(last(images), weights, last(gradient).copy(), last(places).copy(), of_images, *found)
    return [first(of_images), *found]


class Layer(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(3)

    def numbers(self, *shape):
        return self.random.standard_normal(shape).astype(np.float32)

    def test_values_are_those_of_the_definition(self):
        shapes = (3, 5, 100, 100, 32), (20, 2, 3, 3, 16), (5, 3, 9, 14, 48), (1, 64, 6, 7, 16)
        for images, channels, height, width, out in shapes:
            given = self.numbers(images, channels, height, width), self.numbers(out, channels, 3, 3), self.numbers(out)
            found, places = forward(PooledConvolution(2), *given)
            expected = pooled(convolved(*given))
            self.assertEqual(found.shape, expected.shape)
            np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)
            np.testing.assert_array_equal(places == 4, found == 0)

    def test_gradients_are_those_of_differences(self):
        given = [self.numbers(2, 3, 11, 8), self.numbers(16, 3, 3, 3), self.numbers(16)]
        layer = PooledConvolution(1)
        out, places = forward(layer, *given)
        gradient = self.numbers(*out.shape)
        for value, found in zip(given, backward(layer, *given[:2], gradient, places)):
            kept, differences = value.copy(), np.empty(value.shape)
            for place in np.ndindex(value.shape):
                sums = []
                for move in (-1e-3, 1e-3):
                    moved = [one.astype(np.float64) for one in given]
                    moved[next(i for i, one in enumerate(given) if one is value)][place] = float(kept[place]) + move
                    sums.append((pooled(convolved(*moved)) * gradient).sum())
                differences[place] = (sums[1] - sums[0]) / 2e-3
            # A few numbers change which value is the largest.
            wrong = np.abs(found - differences) > 1e-3 * (1 + np.abs(differences))
            self.assertLess(wrong.mean(), 0.03)

    def test_the_first_of_equal_values_gets_the_gradient(self):
        images, weights = np.ones((1, 1, 8, 8), np.float32), np.zeros((16, 1, 3, 3), np.float32)
        layer = PooledConvolution(1)
        _, places = forward(layer, images, weights, np.ones(16, np.float32))
        self.assertEqual(places.max(), 0)
        _, places = forward(layer, images, weights, np.zeros(16, np.float32))
        self.assertEqual(places.min(), 4)

    def test_bits_do_not_depend_on_threads_and_unused_gradients_can_be_left_out(self):
        images, weights, bias = self.numbers(37, 5, 20, 20), self.numbers(32, 5, 3, 3), self.numbers(32)
        results = []
        for threads in (1, 3):
            layer = PooledConvolution(threads)
            out, places = forward(layer, images, weights, bias)
            gradients = backward(layer, images, weights, out, places)
            layer.backward(last(images).copy(), weights, last(out).copy(), last(places).copy(), None,
                           weights_only := np.empty_like(weights), np.empty_like(bias))
            np.testing.assert_array_equal(weights_only, gradients[1])
            results.append([out, *gradients])
        for one, three in zip(*results):
            np.testing.assert_array_equal(one, three)

    def test_nan_stays_nan(self):
        images, weights, bias = self.numbers(1, 1, 8, 8), self.numbers(16, 1, 3, 3), self.numbers(16)
        bias[3] = np.nan
        out, _ = forward(PooledConvolution(1), images, weights, bias)
        self.assertTrue(np.isnan(out[0, 3]).all())
        self.assertFalse(np.isnan(np.delete(out, 3, axis=1)).any())
        images[0, 0, 3, 3] = np.nan  # in the last of the four patches that the first output pools
        out, places = forward(PooledConvolution(1), images, weights, np.zeros_like(bias))
        self.assertTrue(np.isnan(out[0, :, 0, 0]).all())
        self.assertEqual(set(places[0, :, 0, 0]), {3})

    def test_wrong_arrays_are_refused(self):
        layer = PooledConvolution(1)
        images, weights, bias = self.numbers(1, 8, 8, 1), self.numbers(16, 1, 3, 3), self.numbers(16)
        out, places = np.zeros((1, 2, 2, 16), np.float32), np.zeros((1, 2, 2, 16), np.uint8)
        for given, message in (((images[0], weights, bias), "four dimensions"),
                               ((images[:, :2], weights, bias), "at least 3 x 3"),
                               ((images[:, ::-1], weights, bias), "not negative"),
                               ((images, weights[:12], bias[:12]), "multiple of 16, not 12"),
                               ((images, np.zeros((16, 2, 3, 3), np.float32), bias), "16 x 1 x 3 x 3"),
                               ((images.astype(np.float64), weights, bias), "type 'f'"),
                               ((images, weights, bias[:3]), "bias must be a contiguous array of 16 numbers")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                layer.forward(*given, out, places)
        with self.assertRaisesRegex(ValueError, "0 to 4"):
            layer.backward(images, weights, out, places + np.uint8(5), None, np.empty_like(weights), np.empty_like(bias))


if __name__ == "__main__":
    unittest.main()
