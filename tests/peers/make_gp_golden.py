"""Writes tests/golden/gp_likelihood.json: `python make_gp_golden.py > ../golden/gp_likelihood.json`. Needs scikit-learn.

Log marginal likelihood, its gradient and predictions of scikit-learn's Gaussian process with the kernel of scikit-optimize, at
fixed hyperparameters. Predictions are of the noise-free function, as in scikit-optimize.
"""

import json

import numpy
import sklearn
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel

CASES = 20
QUERIES = 3


def make_case(random, number):
    dimensions = int(random.integers(1, 7))
    count = int(random.integers(4, 12))
    points = random.random((count, dimensions)).round(6)
    values = (numpy.sin(5 * points).sum(axis=1) + 0.1 * random.standard_normal(count)).round(6)
    queries = random.random((QUERIES, dimensions)).round(6)
    ranges = ((-1, 1, 1), (-1, 1, dimensions), (-4, 0, 1))  # of the decimal logarithms: amplitude, lengths, noise
    theta = numpy.log(numpy.concatenate([10 ** random.uniform(*limits) for limits in ranges])).round(6)
    name = "rbf" if number % 4 == 3 else "matern52"
    shape = RBF(numpy.ones(dimensions)) if name == "rbf" else Matern(numpy.ones(dimensions), nu=2.5)
    kernel = ConstantKernel() * shape + WhiteKernel()
    process = GaussianProcessRegressor(kernel.clone_with_theta(theta), optimizer=None, normalize_y=True).fit(points, values)
    value, gradient = process.log_marginal_likelihood(theta, eval_gradient=True)
    process.kernel_ = process.kernel_.clone_with_theta(theta)
    process.kernel_.k2.noise_level = 0  # the Cholesky factor still contains the noise
    mean, deviation = process.predict(queries, return_std=True)
    return {
        "kernel": name,
        "points": points.tolist(),
        "values": values.tolist(),
        "theta": theta.tolist(),
        "log_likelihood": float(value),
        "gradient": gradient.tolist(),
        "queries": queries.tolist(),
        "mean": mean.tolist(),
        "deviation": deviation.tolist(),
    }


def main():
    random = numpy.random.default_rng(20)
    cases = [make_case(random, number) for number in range(CASES)]
    lines = ",\n".join(json.dumps(case) for case in cases)
    print(f'{{"made_with": "scikit-learn {sklearn.__version__}", "cases": [\n{lines}\n]}}')


if __name__ == "__main__":
    main()
