"""Writes tests/golden/statistics/*.json: `python make_golden.py` (needs NumPy, SciPy 1.17 or later, and rliable 1.2).

`python make_golden.py aggregate` writes that file alone.

Reference values for core/analysis/statistics; null is NaN. Values come from SciPy, NumPy and rliable, or from the publication named
beside them. The bootstrap's random numbers are those of the harness, reimplemented here from their description
(relign/random.hpp).
"""

import json
import pathlib
import sys
from importlib import metadata

import numpy
import scipy
from rliable import metrics
from rliable.library import run_score_deviation
from scipy import stats

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "golden" / "statistics"


def plain(value):
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, numpy.bool_)):
        return bool(value)
    if isinstance(value, (int, numpy.integer)):
        return int(value)
    if isinstance(value, (float, numpy.floating)):
        return None if numpy.isnan(value) else float(value)
    return value


def write(name, content):
    content = {"written_by": f"tests/analysis/statistics/make_golden.py, SciPy {scipy.__version__}, NumPy {numpy.__version__}", **content}
    (FOLDER / f"{name}.json").write_text(json.dumps(plain(content), indent=1) + "\n")


# ---- bootstrap -----------------------------------------------------------------------------------


def philox(counter, stream, seed):
    c = [counter & 0xFFFFFFFF, counter >> 32, stream & 0xFFFFFFFF, stream >> 32]
    key = [seed & 0xFFFFFFFF, seed >> 32]
    for _ in range(10):
        a, b = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        c = [(b >> 32) ^ c[1] ^ key[0], b & 0xFFFFFFFF, (a >> 32) ^ c[3] ^ key[1], a & 0xFFFFFFFF]
        key = [(key[0] + 0x9E3779B9) & 0xFFFFFFFF, (key[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return c


def draws(instances, resample, seed, level=0):
    words = (word for counter in range(1 << 30) for word in philox(counter, level << 40 | resample, seed))
    drawn = []
    while len(drawn) < instances:
        bits = next(words) << 32 | next(words)
        if bits >= (2**64 - instances) % instances:
            drawn.append(bits % instances)
    return drawn


def iqm(values):
    # Every value four times: then whole values are cut, as trim_mean does.
    return stats.trim_mean(numpy.repeat(values, 4), 0.25)


STATISTICS = {"mean": numpy.mean, "median": numpy.median, "iqm": iqm, "q90": lambda values: numpy.quantile(values, 0.9)}


def expanded(replicates, n, confidence):
    t = stats.t.ppf((1 - confidence) / 2, n - 1)
    tail = stats.norm.cdf(numpy.sqrt(n / (n - 1)) * t)
    return numpy.quantile(replicates, [tail, 1 - tail])


def bootstrap():
    random = numpy.random.default_rng(1)
    seed, resamples = 0x123456789ABCDEF, 300
    cases = []
    for n, missing in ((13, 0), (100, 0), (20, 6)):
        values = numpy.exp(random.standard_normal(n)).round(3)
        values[2] = values[1]  # a tie
        if missing:
            values[random.choice(n, missing, replace=False)] = numpy.nan
        drawn = [draws(n, resample, seed) for resample in range(resamples)]
        case = {"values": values, "statistics": {}}
        for name, statistic in STATISTICS.items():
            samples = [values[indices] for indices in drawn]
            replicates = [statistic(sample[~numpy.isnan(sample)]) for sample in samples]
            case["statistics"][name] = {
                "estimate": statistic(values[~numpy.isnan(values)]),
                "replicates": replicates[:20],
                "interval_95": expanded(replicates, n - missing, 0.95),
                "interval_80": expanded(replicates, n - missing, 0.8),
            }
        case["counts"] = [numpy.bincount(indices, minlength=n) for indices in drawn[:3]]
        cases.append(case)
    write("bootstrap", {"seed": seed, "resamples": resamples, "cases": cases})


# ---- aggregates over strata ----------------------------------------------------------------------


def even(strata):
    """The strata's values, each as often as makes the strata equally large, and four times, so that rliable cuts whole values."""
    strata = [numpy.ravel(values)[~numpy.isnan(numpy.ravel(values))] for values in strata]
    strata = [values for values in strata if values.size]
    size = numpy.lcm.reduce([values.size for values in strata]) * 4
    return numpy.concatenate([numpy.repeat(values, size // values.size) for values in strata])[None]


def pooled(errors, places):
    """Of errors [stratum][training, instance]; rliable's scores are 1 - error, and every instance is a task."""
    errors = even(errors)
    scores = 1 - errors
    return [1 - metrics.aggregate_iqm(scores), 1 - metrics.aggregate_median(scores), metrics.aggregate_optimality_gap(scores),
            *(1 - run_score_deviation(errors, place) for place in places)]


def improvement(first, second):
    """rliable's, with every instance as a task and trainings as its runs; strata weigh the same."""
    shares = []
    for left, right in zip(first, second):
        both = ~numpy.isnan(left).any(axis=0) & ~numpy.isnan(right).any(axis=0)
        if both.any():
            shares.append(metrics.probability_of_improvement(1 - left[:, both], 1 - right[:, both]))
    return numpy.mean(shares)


def aggregate():
    random = numpy.random.default_rng(5)
    seed, resamples, places = 0x123456789ABCDEF, 200, [0, 0.2, 0.5, 0.975]
    cases = []
    for instances, trainings, missing in (([8, 8, 8], [1, 1], 0), ([8, 5], [1, 1], 0), ([9, 9], [4, 1], 0), ([6, 6], [3, 2], 0),
                                          ([10, 7], [1, 1], 4)):
        methods = []
        for method, count in enumerate(trainings):
            errors = [numpy.clip(random.normal(0.35 + 0.1 * method, 0.3, (count, n)) + random.normal(0, 0.1, (count, 1)), 0, 1).round(3)
                      for n in instances]
            errors[0][0, 0] = errors[0][0, 1]
            for _ in range(missing):
                errors[random.integers(len(errors))][0, random.integers(5)] = numpy.nan
            methods.append(errors)
        drawn = {n: [draws(n, resample, seed) for resample in range(resamples)] for n in set(instances)}

        def resample(method, b):
            count = trainings[method]
            rows = draws(count, b, seed, sum(one > 1 for one in trainings[:method + 1])) if count > 1 else [0]
            return [errors[numpy.ix_(rows, drawn[n][b])] for errors, n in zip(methods[method], instances)]

        def interval(replicates, method_places):
            fewest = min(min(int((~numpy.isnan(one)).sum() / one.shape[0]) for one in methods[m]) for m in method_places)
            return expanded(replicates, min([fewest] + [trainings[m] for m in method_places if trainings[m] > 1]), 0.95)

        case = {"instances": instances, "trainings": trainings, "errors": [[one.ravel() for one in errors] for errors in methods],
                "methods": [], "improvement": improvement(*methods)}
        for method in range(2):
            replicates = numpy.array([pooled(resample(method, b), places) for b in range(resamples)])
            case["methods"].append({"estimate": pooled(methods[method], places), "replicates_mean": replicates.mean(axis=0),
                                    "intervals": [interval(one, [method]) for one in replicates.T]})
        won = [improvement(resample(0, b), resample(1, b)) for b in range(resamples)]
        if not missing:
            case["improvement_interval"] = interval(won, [0, 1])
        cases.append(case)
    write("aggregate", {"rliable": metadata.version("rliable"), "seed": seed, "resamples": resamples,
                        "places": places, "cases": cases})


# ---- the rest ------------------------------------------------------------------------------------


def distributions():
    write("distributions", {
        "normal_lower": [[z, stats.norm.cdf(z)] for z in (-8.0, -1.5, 0.0, 2.5)],
        "normal_quantile": [[p, stats.norm.ppf(p)] for p in (1e-10, 0.025, 0.5, 0.999)],
        "student_t_quantile": [[p, d, stats.t.ppf(p, d)] for p, d in ((0.025, 1), (0.025, 9), (0.9, 99), (0.025, 4.5))],
        "chi_squared_upper": [[x, d, stats.chi2.sf(x, d)] for x, d in ((0.0, 3), (9.28, 3), (120.0, 9))],
        "fisher_f_upper": [[x, a, b, stats.f.sf(x, a, b)] for x, a, b in ((3.69, 3, 39), (0.2, 5, 20), (80.0, 2, 198))],
    })


def proportion():
    cases = []
    for successes, trials in ((0, 1), (1, 1), (0, 10), (10, 10), (3, 10), (95, 100), (50, 100), (999, 1000)):
        for confidence in (0.95, 0.8):
            interval = stats.binomtest(successes, trials).proportion_ci(confidence, "wilson")
            cases.append([successes, trials, confidence, interval.low, interval.high])
    write("proportion", {"cases": cases})


def signed_rank():
    random = numpy.random.default_rng(2)
    cases = []
    for n, step, zeros in ((1, 0, 0), (5, 0, 0), (6, 0, 0), (25, 0, 0), (50, 0, 0), (12, 0.5, 0), (13, 0.25, 3), (51, 0, 0),
                           (80, 0.25, 7), (400, 0, 0)):
        values = random.standard_normal(n) + 0.3
        values = (values / step).round() * step if step else values.round(6)
        if step:
            values[values == 0] = step
        values[: zeros] = 0
        test = stats.wilcoxon(values)
        cases.append({"differences": values, "statistic": test.statistic, "p": test.pvalue})
    write("signed_rank", {"cases": cases})


def ranks():
    random = numpy.random.default_rng(3)
    # Demsar, JMLR 7 (2006), table 6: AUC of C4.5, C4.5+m, C4.5+cf, C4.5+m+cf on 14 data sets. Next to last
    # row: both are printed as 0.975, but ranked 2 and 3.
    demsar = numpy.array([
        [0.763, 0.768, 0.771, 0.798], [0.599, 0.591, 0.590, 0.569], [0.954, 0.971, 0.968, 0.967], [0.628, 0.661, 0.654, 0.657],
        [0.882, 0.888, 0.886, 0.898], [0.936, 0.931, 0.916, 0.931], [0.661, 0.668, 0.609, 0.685], [0.583, 0.583, 0.563, 0.625],
        [0.775, 0.838, 0.866, 0.875], [1.000, 1.000, 1.000, 1.000], [0.940, 0.962, 0.965, 0.962], [0.619, 0.666, 0.614, 0.669],
        [0.972, 0.981, 0.9751, 0.975], [0.957, 0.978, 0.946, 0.970]])
    tables = [-demsar, random.standard_normal((3, 3)), random.standard_normal((60, 6)) + 0.2 * numpy.arange(6),
              random.integers(0, 4, (30, 5)).astype(float)]
    cases = []
    for table in tables:
        table = table.round(4)
        n, k = table.shape
        test = stats.friedmanchisquare(*table.T)
        f = (n - 1) * test.statistic / (n * (k - 1) - test.statistic)
        cases.append({"columns": table.T, "mean_ranks": stats.rankdata(table, axis=1).mean(axis=0), "chi_squared": test.statistic,
                      "p": test.pvalue, "f": f, "f_p": stats.f.sf(f, k - 1, (k - 1) * (n - 1))})
    write("ranks", {"demsar_mean_ranks": [3.143, 2.000, 2.893, 1.964], "demsar_chi_squared_without_ties": 9.28, "cases": cases})


def survival():
    random = numpy.random.default_rng(4)
    # Weeks of remission under 6-MP, Freireich et al., Blood 21 (1963); survival and Greenwood's errors as in Kalbfleisch
    # and Prentice, The Statistical Analysis of Failure Time Data.
    weeks = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
    reached = [1, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]
    published = [[6, 0.857, 0.0764], [7, 0.807, 0.0869], [10, 0.753, 0.0963], [13, 0.690, 0.1068], [16, 0.627, 0.1141],
                 [22, 0.538, 0.1282], [23, 0.448, 0.1346]]
    times = random.geometric(0.04, 100)
    cases = []
    for steps, there in ((weeks, reached), (numpy.minimum(times, 30), times <= 30), (numpy.minimum(times, 300), times <= 300)):
        steps, there = numpy.array(steps), numpy.array(there).astype(bool)
        sf = stats.ecdf(stats.CensoredData(uncensored=steps[there], right=steps[~there])).sf
        band = sf.confidence_interval(0.95, method="log-log")
        linear = sf.confidence_interval(0.95, method="linear")
        at = sf.quantiles
        # The linear interval gives Greenwood's error where it is not cut off at 0 or 1.
        error = (sf.probabilities - linear.low.probabilities) / stats.norm.ppf(0.975)
        error[linear.low.probabilities <= 0] = numpy.nan
        cases.append({"steps": steps, "reached": there, "at": at, "survival": sf.probabilities, "error": error,
                      "low": band.low.probabilities, "high": band.high.probabilities})
    write("survival", {"published": published, "published_median": 23, "cases": cases})


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for make in (bootstrap, aggregate, distributions, proportion, signed_rank, ranks, survival):
        if make.__name__ in (sys.argv[1:] or [make.__name__]):
            make()
