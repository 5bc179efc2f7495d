"""The statistics of docs/statistics.md by SciPy, NumPy and pandas: a reference for core/analysis/statistics on whole reports.

What SciPy 1.10 lacks is written from the definition: Kaplan and Meier's median, Holm, signed ranks with ties.
"""

from collections import Counter

import numpy as np
import pandas as pd
from scipy import special, stats


def quartiles(values):
    values = np.asarray(values, float)
    values = values[~np.isnan(values)]
    if not values.size:
        return {"n": 0}
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
    return {"n": int(values.size), "median": middle, "q25": low, "q75": high}


# ---- bootstrap -----------------------------------------------------------------------------------


def philox(counter, resample, seed):
    """Philox4x32-10 for many resamples at once: four 32-bit words each."""
    low, shift = np.uint64(0xFFFFFFFF), np.uint64(32)
    c = [np.full_like(resample, counter), np.zeros_like(resample), resample & low, resample >> shift]
    key = [seed & 0xFFFFFFFF, seed >> 32]
    for _ in range(10):
        a, b = np.uint64(0xD2511F53) * c[0], np.uint64(0xCD9E8D57) * c[2]
        c = [(b >> shift) ^ c[1] ^ np.uint64(key[0]), b & low, (a >> shift) ^ c[3] ^ np.uint64(key[1]), a & low]
        key = [(key[0] + 0x9E3779B9) & 0xFFFFFFFF, (key[1] + 0xBB67AE85) & 0xFFFFFFFF]
    return c


def draws(instances, resamples, seed, level=0):
    """[resample, draw]: the index of the drawn instance; at level 1, 2, ... of the drawn training."""
    resample = np.arange(resamples, dtype=np.uint64) + np.uint64(level << 40)
    words = [word for counter in range((instances + 1) // 2) for word in philox(counter, resample, seed)]
    bits = np.stack([high << np.uint64(32) | low for high, low in zip(words[::2], words[1::2])], axis=1)[:, :instances]
    # The program skips values below 2^64 mod n; none occurs here, at a probability of n / 2^64.
    assert (bits >= np.uint64(2**64 % instances)).all()
    return (bits % np.uint64(instances)).astype(int)


def iqm(rows):
    """Interquartile mean of each row, without NaN: every value four times, then a quarter of them is cut at either end."""
    rows = np.sort(rows, axis=-1)
    there = (~np.isnan(rows)).sum(axis=-1)
    result = np.full(len(rows), np.nan)
    for n in np.unique(there[there > 0]):
        result[there == n] = stats.trim_mean(np.repeat(rows[there == n, :n], 4, axis=-1), 0.25, axis=-1)
    return result


def medians(rows):
    if not np.isnan(rows).any():
        return np.median(rows, axis=-1)
    return pd.DataFrame(rows).median(axis=1).to_numpy()


def student_t_quantile(degrees):
    """Student's t at 2.5 % by the beta function: the error of t.ppf of SciPy 1.10, 1e-9, would change the ends of a band."""
    share = special.betaincinv(degrees / 2, 0.5, 0.05)
    return -np.sqrt(degrees * (1 - share) / share)


def band(column, drawn, statistic=medians):
    """The ends of the expanded percentile interval; column: one value per instance, NaN where there is none."""
    n = np.count_nonzero(~np.isnan(column))
    if n < 2:
        return [np.nan, np.nan]
    replicates = statistic(column[drawn])
    tail = stats.norm.cdf(np.sqrt(n / (n - 1)) * student_t_quantile(n - 1))
    return list(np.quantile(replicates[~np.isnan(replicates)], [tail, 1 - tail]))


# ---- the rest ------------------------------------------------------------------------------------


def kaplan_meier_median(times, reached):
    """The median time and Brookmeyer and Crowley's interval, from the log-log interval of the survival.

    Where the survival is 0, the interval is the exact limit for no survivor among those at risk.
    """
    at = pd.DataFrame({"time": times, "reached": reached}).groupby("time").reached.agg(["sum", "count"]).sort_index()
    at_risk = len(times) - at["count"].cumsum().shift(fill_value=0)
    survival = (1 - at["sum"] / at_risk).cumprod()
    with np.errstate(divide="ignore", invalid="ignore"):
        greenwood = (at["sum"] / (at_risk * (at_risk - at["sum"]))).cumsum()
        spread = stats.norm.ppf(0.975) * np.sqrt(greenwood) / -np.log(survival)
        low, high = survival ** np.exp(spread), survival ** np.exp(-spread)
    low[survival == 1] = high[survival == 1] = 1
    low[survival == 0] = 0
    ends = survival.shift(fill_value=1) * (1 - 0.025 ** (1 / at_risk))
    high[survival == 0] = ends[survival == 0]

    def first(share):
        return next(iter(share.index[share <= 0.5 + 1e-12]), np.inf)

    return first(survival), first(low), first(high)


def signed_rank_p(differences):
    """p of the two-sided test; zeros are left out."""
    differences = differences[~np.isnan(differences)]
    differences = differences[differences != 0]
    if not differences.size:
        return 1.0
    ranks = stats.rankdata(np.abs(differences))
    if differences.size > 50:
        return stats.wilcoxon(differences, method="approx", correction=False).pvalue
    if np.unique(ranks).size == ranks.size:
        return stats.wilcoxon(differences, method="exact").pvalue
    sums = Counter({0.0: 1})  # of the ranks with a positive sign, over all signs
    for rank in ranks:
        sums = sums + Counter({total + rank: count for total, count in sums.items()})
    smaller = min(ranks[differences > 0].sum(), ranks[differences < 0].sum())
    return min(1.0, 2 * sum(count for total, count in sums.items() if total <= smaller) / 2**differences.size)


def holm(p):
    order = np.argsort(p, kind="stable")
    corrected = np.empty(len(p))
    corrected[order] = np.minimum(1, np.maximum.accumulate(np.asarray(p)[order] * np.arange(len(p), 0, -1)))
    return corrected


def friedman(columns):
    """The number of instances that all methods have, and p of Iman and Davenport's F."""
    table = np.stack(columns, axis=1)
    table = table[~np.isnan(table).any(axis=1)]
    n, k = table.shape
    if n < 2:
        return n, np.nan
    squared = stats.friedmanchisquare(*table.T).statistic
    left = n * (k - 1) - squared
    f = np.inf if left <= 1e-9 * n * (k - 1) else (n - 1) * squared / left
    return n, stats.f.sf(f, k - 1, (k - 1) * (n - 1))
