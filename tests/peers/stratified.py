"""The aggregates of a report over all scenes and noise levels, from docs/statistics.md, by NumPy.

Every resample is written out as the drawn values with a weight each; the program instead walks once over sorted values.
"""

import numpy as np
from scipy import stats
from scipy_statistics import draws, student_t_quantile

PLACES = np.arange(41) / 40
MOST_COMPARED = 12
STATISTICS = ("iqm", "median", "gap")


def pooled(values, weights):
    """IQM, median, mean and profile of each row; values [row, value] with weights that add up to 1."""
    order = np.argsort(values, axis=1, kind="stable")
    values, weights = np.take_along_axis(values, order, 1), np.take_along_axis(weights, order, 1)
    passed = np.cumsum(weights, axis=1)
    middle = np.diff(np.clip(2 * (passed - 0.25), 0, 1), axis=1, prepend=0)
    at = (passed < 0.5 - 1e-9).sum(axis=1)
    rows = np.arange(len(values))
    median, exact = values[rows, at], np.abs(passed[rows, at] - 0.5) < 1e-9
    following = np.argmax((np.arange(values.shape[1]) > at[:, None]) & (weights > 0), axis=1)
    median = np.where(exact, (median + values[rows, following]) / 2, median)
    profile = [(weights * (values <= place)).sum(axis=1) for place in PLACES]
    return np.stack([(middle * values).sum(axis=1), median, (weights * values).sum(axis=1), *profile])


def interval(replicates, n):
    if n < 2:
        return np.nan, np.nan
    tail = stats.norm.cdf(np.sqrt(n / (n - 1)) * student_t_quantile(n - 1))
    return tuple(np.quantile(replicates[~np.isnan(replicates)], [tail, 1 - tail]))


def weighted(values, counts):
    """All values of a method in one array, and their weights by resample; counts[stratum]: [resample, training, instance]."""
    there = [~np.isnan(one) for one in values]
    weights = [count[:, known] for count, known in zip(counts, there)]
    drawn = [one.sum(axis=1, keepdims=True) for one in weights]
    strata = sum(one > 0 for one in drawn)
    weights = [one / np.maximum(total, 1) / strata for one, total in zip(weights, drawn)]
    return np.concatenate([one[known] for one, known in zip(values, there)]), np.concatenate(weights, axis=1)


class Aggregate:
    def __init__(self, manifest, trials, resamples, classes):
        self.protocol, self.seed, self.resamples = trials.protocol.iloc[0], int(manifest["seed"]), resamples
        self.classes = classes  # by name of the method, or list, and protocol
        counts = trials.end.isin(["budget_spent", "finished"]) & (trials.made > 0)
        trials = trials.assign(counts=counts, last=[one[-1] if len(one) else np.nan for one in trials.normalised],
                               area=[self.area(one, budget) for one, budget in zip(trials.normalised, trials.budget)])
        trials.loc[trials.area.isna(), "last"] = np.nan
        self.strata = [(place, of) for place, of in trials.groupby(["scene", "noise_level"], sort=False)
                       if of[of.counts].area.notna().any()]
        self.instances = [sorted(of.instance.unique()) for _, of in self.strata]
        self.methods = {}
        for stratum, (_, of) in enumerate(self.strata):
            for (algorithm, method, training), series in of.groupby(["algorithm", "method", "training"], sort=False):
                name = method or algorithm
                one = self.methods.setdefault(name, {}).setdefault(training, {})
                numbers = self.series(series, self.instances[stratum])
                if numbers:
                    one[stratum] = numbers

    @staticmethod
    def area(errors, budget):
        if not len(errors):
            return np.nan
        budget = max(budget, len(errors) - 1)
        return np.mean([errors[min(step, len(errors) - 1)] for step in range(1, budget + 1)])

    @staticmethod
    def series(series, instances):
        """The trials of one method or training in a stratum: [instance, (last, area)], failed ones as 1."""
        failed, good = series[~series.counts], series[series.counts & series.area.notna()]
        if not len(failed) + len(good):
            return None
        values = np.full((len(instances), 2), np.nan)
        values[np.searchsorted(instances, good.instance)] = good[["last", "area"]]
        values[np.searchsorted(instances, failed.instance)] = 1
        budget = int(series[series.counts].budget.max()) if series.counts.any() else 0
        steps = [np.mean([errors[min(step, len(errors) - 1)] for errors in good.normalised] + [1] * len(failed))
                 for step in range(budget + 1)]
        return {"values": values, "failed": len(failed), "budget": budget, "by_step": steps}

    def counts(self, trainings, level):
        """Number of draws of each cell in each resample: [stratum] [resample, training, instance]."""
        drawn = {n: self.counted(n, 0) for n in {len(one) for one in self.instances}}
        rows = self.counted(trainings, level) if trainings > 1 else np.ones((self.resamples, 1), int)
        return [rows[:, :, None] * drawn[len(one)][:, None, :] for one in self.instances]

    def counted(self, n, level):
        return np.stack([np.bincount(one, minlength=n) for one in draws(n, self.resamples, self.seed, level)])

    @staticmethod
    def fewest(values):
        return min(np.count_nonzero(~np.isnan(one)) // one.shape[0] for one in values)

    def bands(self, values, level):
        """values[stratum]: [training, instance, (last, area)]."""
        trainings, result = values[0].shape[0], {}
        counts = self.counts(trainings, level)
        once = [np.ones((1, *one.shape[:2])) for one in values]
        n = self.fewest([one[:, :, 0] for one in values])
        n = min(n, trainings) if trainings > 1 else n
        both = []
        for what in (0, 1):
            flat, weights = weighted([one[:, :, what] for one in values], counts)
            replicates = np.concatenate([pooled(np.tile(flat, (len(some), 1)), some)
                                         for some in np.array_split(weights, max(1, len(weights) // 500))], axis=1)
            flat, weights = weighted([one[:, :, what] for one in values], once)
            both.append((pooled(flat[None], weights)[:, 0], [interval(one, n) for one in replicates]))
            if what == 0:
                result["n"] = int(flat.size)
        (ends, ends_of), (areas, areas_of) = both
        for name, estimate, (low, high) in [*zip(STATISTICS, ends, ends_of), ("area", areas[2], areas_of[2])]:
            result[name], result[name + "_lo95"], result[name + "_hi95"] = estimate, low, high
        profile = {"share": ends[3:], "lo95": [low for low, _ in ends_of[3:]], "hi95": [high for _, high in ends_of[3:]]}
        return result, {key: list(one) for key, one in profile.items()}

    def improvement(self, first, second):
        """The share of instances on which one of the first is better than one of the second."""
        (left, left_level), (right, right_level) = first, second
        one, other = left[0].shape[0], right[0].shape[0]
        lens = self.counts(1, 0)
        rows = self.counted(one, left_level) if one > 1 else np.ones((self.resamples, 1), int)
        columns = self.counted(other, right_level) if other > 1 else np.ones((self.resamples, 1), int)
        shares, estimates, fewest, n = [], [], [], 0
        for values, others, count in zip(left, right, lens):
            a, b = values[:, None, :, 0], others[None, :, :, 0]
            known = ~np.isnan(a) & ~np.isnan(b)
            won = np.where(known, (a < b) + 0.5 * (a == b), 0)
            pairs = rows[:, :, None] * columns[:, None, :]
            met = np.einsum("rkl,kli,ri->r", pairs, known.astype(float), count[:, 0, :])
            with np.errstate(invalid="ignore"):
                shares.append(np.einsum("rkl,kli,ri->r", pairs, won, count[:, 0, :]) / met)
            estimates.append(won.sum() / known.sum() if known.any() else np.nan)
            fewest.append(known.sum(axis=2).min())
            n += int(known.sum())
        expanded = min([min(fewest), *(k for k in (one, other) if k > 1)])
        low, high = interval(np.nanmean(shares, axis=0), expanded)
        return {"n": n, "improvement": np.nanmean(estimates), "lo95": low, "hi95": high}

    def numbers(self):
        described, values = [], {}
        for name, trainings in self.methods.items():
            members = list(trainings.values())
            strata = min(len(of) for of in members)
            steps = max((one["budget"] for of in members for one in of.values()), default=0)
            method = {"method": name, "class": self.classes[name, self.protocol], "strata": strata, "steps": steps,
                      "failed": sum(one["failed"] for of in members for one in of.values())}
            if strata == len(self.strata):
                values[name] = [np.stack([of[stratum]["values"] for of in members]) for stratum in range(len(self.strata))]
                method["by_step"] = [np.mean([one["by_step"][min(step, len(one["by_step"]) - 1)]
                                              for member in members for one in member.values()])
                                     for step in range(steps + 1)]
            described.append(method)
        iqm = {}
        for name, one in values.items():
            flat, weights = weighted([of[:, :, 0] for of in one], [np.ones((1, *of.shape[:2])) for of in one])
            iqm[name] = pooled(flat[None], weights)[0, 0]
        described.sort(key=lambda method: iqm.get(method["method"], np.inf))
        levels, level = {}, 0
        for method in described:
            name = method["method"]
            if name not in values:
                continue
            several = values[name][0].shape[0] > 1
            level += several
            levels[name] = level if several else 0
            numbers, profile = self.bands(values[name], levels[name])
            method.update(numbers, profile=profile)
            names = list(self.methods[name])
            if names == [""]:
                continue
            method["trainings"] = [{"training": training,
                                    "failed": sum(one["failed"] for one in self.methods[name][training].values()),
                                    **self.bands([of[[place]] for of in values[name]], 0)[0]}
                                   for place, training in enumerate(names)]
            if several:
                of_trainings = [one["iqm"] for one in method["trainings"]]
                method["spread"] = {"lowest": min(of_trainings), "highest": max(of_trainings),
                                    "sd": np.std(of_trainings, ddof=1)}
        ranked = [method["method"] for method in described if method["method"] in values]
        firsts = ranked if len(ranked) <= MOST_COMPARED else ranked[:1]
        pairs = [{"a": a, "b": b, **self.improvement((values[a], levels[a]), (values[b], levels[b]))}
                 for a in firsts for b in ranked[ranked.index(a) + 1:]]
        return {"protocol": self.protocol, "resolution": 1e-4, "methods": described, "pairs": pairs,
                "profile_places": list(PLACES),
                "strata": [{"scene": scene, "noise_level": level, "instances": len(of)}
                           for ((scene, level), _), of in zip(self.strata, self.instances)]}
