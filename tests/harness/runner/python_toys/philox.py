"""relign/random.hpp in Python, bit for bit: enough of it for the toys."""

import math

_MASK = 0xFFFFFFFF


def _block(counter, seed):
    c, key = [counter & _MASK, counter >> 32, 0, 0], [seed & _MASK, seed >> 32]
    for _ in range(10):
        a, b = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        c = [(b >> 32) ^ c[1] ^ key[0], b & _MASK, (a >> 32) ^ c[3] ^ key[1], a & _MASK]
        key = [(key[0] + 0x9E3779B9) & _MASK, (key[1] + 0xBB67AE85) & _MASK]
    return c


def _log(x):
    mantissa, exponent = math.frexp(x)
    if mantissa < 0.70710678118654752:
        mantissa *= 2
        exponent -= 1
    s = (mantissa - 1) / (mantissa + 1)
    series = 0.0
    for term in range(25, 0, -2):
        series = series * (s * s) + 1.0 / term
    return 2 * s * series + exponent * 0.69314718055994531


class Random:
    def __init__(self, seed):
        self._words = (word for counter in range(1 << 62) for word in _block(counter, seed))
        self._spare = None

    def uniform(self, lower=0.0, upper=1.0):
        bits = next(self._words) << 32 | next(self._words)
        return lower + (upper - lower) * ((bits >> 11) * 2.0**-53)

    def normal(self):
        if self._spare is not None:
            spare, self._spare = self._spare, None
            return spare
        while True:
            u, v = 2 * self.uniform() - 1, 2 * self.uniform() - 1
            s = u * u + v * v
            if s >= 1 or s == 0:
                continue
            scale = math.sqrt(-2 * _log(s) / s)
            self._spare = v * scale
            return u * scale
