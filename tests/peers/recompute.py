"""The numbers of a report, recomputed from the raw records of a results folder with pandas and SciPy.

Written from docs/statistics.md and results/README.md, not translated from core/analysis/statistics. The result has the
structure of `relign-bench report --format json`; `compare_report.py` compares the two.
"""

import json
import pathlib

import numpy as np
import pandas as pd
from scipy import stats
from scipy_statistics import band, draws, friedman, holm, iqm, kaplan_meier_median, quartiles, signed_rank_p
from stratified import Aggregate

RULES = {"own": "recommended", "best": "recommended_best", "current": "recommended_current"}  # and their tracks
TRACKS = ("measured", "best", "commanded", "recommended", "excess", "recommended_best", "recommended_current")
EXCESS = {"own": "excess", "best": "excess_best", "current": "excess_current"}
EXCESS_IMAGES = (6, 12, 50)
GLUED = {"own": "mtf_", "best": "best_mtf_", "current": "current_mtf_"}  # members of closing lines
UNCURED = {"own": "uncured_mtf_", "best": "best_uncured_mtf_", "current": "current_uncured_mtf_"}
MTF = [of + point for of in (*GLUED.values(), *UNCURED.values(), "own_optimum_mtf_") for point in ("centre", "corner")]
ENDED_WELL = ("budget_spent", "finished")
FINAL_STATISTICS = {"iqm": iqm}  # by the key in kFinalStatistics (order_statistic.h): functions of the rows of an array
RESOLUTION = 1e-4  # resolution of the RMSE
RELEVANT_RATIO = 1.1  # unless the analysis plan has another one
FEWEST_COMPARED = 6
MOST_COMPARED = 12


# ---- reading -------------------------------------------------------------------------------------


def lines(folder):
    for file in sorted(folder.glob("*.jsonl")):
        for line in file.read_text().splitlines():
            yield json.loads(line)


def rmse(mse):
    return np.sqrt(np.maximum(0, mse))


def read(folder):
    """The manifest, and one row per planned trial; the tracks of a row are arrays with one value per step."""
    folder = pathlib.Path(folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    planned = set(manifest["order"])
    seconds = {line["trial"]: line["algorithm_seconds"] for line in lines(folder / "times")}
    steps, rows, seen = {}, [], set()
    for line in lines(folder / "trials"):
        if "end" not in line:
            steps.setdefault(line["trial"], []).append(line)
        elif line["trial"] in planned and line["trial"] not in seen:
            seen.add(line["trial"])
            rows.append({"own_optimum_pose": [], "uncured_mse": np.nan, "method": "", "training": "",
                         **dict.fromkeys(MTF, np.nan), **line, **tracks(steps.get(line["trial"], []), line),
                         "host_seconds": seconds.get(line["trial"], [])})
    return manifest, pd.DataFrame(rows)


def tracks(steps, closing):
    of = pd.DataFrame(steps, columns=["measured", "commanded_mse", "recommended_mse", "machine_seconds",
                                      "recommended_seconds"]).astype(float)
    own = np.nan if closing["own_optimum_mse"] is None else closing["own_optimum_mse"]
    shifts = closing.get("uncured_mse") is not None
    glued = np.array(closing.get("glued_mse") or [np.nan] * len(of), dtype=float) if shifts else of.commanded_mse.to_numpy()
    # The step of the lowest measured error so far, the first of equal ones.
    lowest = [int(np.argmin(of.measured[:made])) for made in range(1, len(of) + 1)]
    best = glued[lowest] if len(of) else glued
    best_uncured = of.commanded_mse[lowest[-1]] if len(of) else np.nan
    if closing.get("best_mse"):
        best, best_uncured = np.array(closing["best_mse"], dtype=float), closing.get("best_uncured_mse", np.nan)
    return {
        "recommended_best": rmse(best),
        "recommended_current": rmse(glued),
        "uncured": {"own": closing["uncured_mse"], "best": best_uncured, "current": of.commanded_mse.iloc[-1]}
                   if shifts and len(of) else dict.fromkeys(RULES, np.nan),
        "made": len(of),
        "measured": of.measured.to_numpy(),
        "best": of.measured.cummin().to_numpy(),
        "commanded": rmse(of.commanded_mse.to_numpy()),
        "recommended": rmse(of.recommended_mse.to_numpy()),
        "excess": rmse(of.recommended_mse.to_numpy() - own),
        "excess_best": rmse(best - own),
        "excess_current": rmse(glued - own),
        "start_excess": rmse(of.commanded_mse.iloc[0] - own) if len(of) else np.nan,
        "machine": of.machine_seconds.to_numpy(),
        "until_glued": of.recommended_seconds.fillna(of.machine_seconds).to_numpy(),
        "own": rmse(own),
        **{"normalised_" + rule: normalised(of, mse, own) for rule, mse in
           (("own", of.recommended_mse.to_numpy()), ("best", best), ("current", glued))},
        "ended_at": steps[-1]["recommended_true_pose"] if steps else [],
    }


def normalised(steps, mse, own):
    """Error of each step as a share of the decades between start and resolution."""
    start = rmse(steps.commanded_mse.iloc[0] - own) if len(steps) else np.nan
    if not start > RESOLUTION:
        return np.full(len(steps), np.nan)
    excess = np.maximum(rmse(mse - own), RESOLUTION)
    return np.clip(np.log(excess / RESOLUTION) / np.log(start / RESOLUTION), 0, 1)


def scene_folder(folder, manifest, scene):
    return next(pathlib.Path(folder) / entry["folder"] for entry in manifest["scenes"] if entry["name"] == scene)


def axes_of(folder):
    file = folder / "description.json"
    return json.loads(file.read_text())["axes"] if file.exists() else []


def excess_of_next_image(folder, noise_level):
    file = folder / "next_image" / f"{noise_level}.json"
    return np.mean([lens["excess_mse"] for lens in json.loads(file.read_text())["lenses"]]) if file.exists() else None


def spec_of(manifest, scene):
    specs = [manifest["spec"]] if manifest.get("spec") else [e.get("spec") for e in manifest["scenes"] if e["name"] == scene]
    return next((spec for spec in specs if spec), {})


# ---- numbers of a group --------------------------------------------------------------------------


def arrival(track, target):
    hits = np.flatnonzero(track <= target)
    return hits[0] if hits.size else None


def ends_of(trials, rule="own"):
    return np.array([values[-1] for values in trials[RULES[rule]]], dtype=float)


def class_of(method):
    """What a method observes; `method` is its entry in the manifest."""
    if method.get("oracle"):
        return "oracle"
    if "images" in method["observes"]:
        return "images and design" if {"design", "level"} & set(method["observes"]) else "images"
    return "merit" if "merit" in method["observes"] else "neither"


def band_steps(last):
    steps = {0, last, *(int(np.floor(np.expm1(np.log1p(last) * k / 15) + 0.5)) for k in range(16))}
    for step in range(1, last):
        if len(steps) >= min(16, last + 1):
            break
        steps.add(step)
    return steps


def yield_of(met, failed):
    inside, n = int(met.sum()), len(met) + failed
    low, high = stats.binomtest(inside, n).proportion_ci(method="wilson")
    return {"in": inside, "n": n, "share": inside / n, "lo95": low, "hi95": high}


class Group:
    def __init__(self, folder, manifest, trials, resamples, bands_of, rule):
        self.trials, self.bands_of, self.rule, self.of_rule = trials, bands_of, rule, RULES[rule]
        plan = manifest.get("analysis") or {}
        self.relevant = plan.get("smallest_relevant_ratio", RELEVANT_RATIO)
        self.contrasts = [set(pair) for pair in plan.get("contrasts", [])]
        self.methods = {one["name"]: one for one in manifest["algorithms"] if one["protocol"] == trials.protocol.iloc[0]}
        self.scene = trials.scene.iloc[0]
        of_scene = scene_folder(folder, manifest, self.scene)
        self.axes, self.excess = axes_of(of_scene), excess_of_next_image(of_scene, trials.noise_level.iloc[0])
        self.targets = manifest.get("targets") or list(0.05 * (0.0005 / 0.05) ** (np.arange(31) / 30))
        spec = spec_of(manifest, self.scene)
        self.spec, self.mtf = spec.get("rmse"), spec.get("mtf") or {}
        self.limits = {point: self.mtf[point] for point in ("centre", "corner") if point in self.mtf}
        self.judges = self.spec is not None or bool(self.limits)
        self.instances = sorted(trials.instance.unique())
        self.drawn = draws(len(self.instances), resamples, int(manifest["seed"]))
        counts = trials.end.isin(ENDED_WELL) & (trials.made > 0)
        self.by_method = {name: (of[counts[of.index]], int((~counts[of.index]).sum()))
                          for name, of in trials.groupby("algorithm", sort=False)}

    def column(self, trials, values):
        return pd.Series(list(values), index=trials.instance, dtype=float).reindex(self.instances).to_numpy()

    def last(self, trials, track):
        return self.column(trials, [values[-1] for values in trials[track]])

    def with_bands(self, column, bands=True, statistics=()):
        found = quartiles(column)
        if bands and found["n"]:
            found["lo95"], found["hi95"] = band(column, self.drawn)
        for key in statistics if found["n"] else ():
            found[key] = FINAL_STATISTICS[key](column[None])[0]
            found[key + "_lo95"], found[key + "_hi95"] = band(column, self.drawn, FINAL_STATISTICS[key])
        return found

    def row(self, name):
        trials, failed = self.by_method[name]
        recommended = self.last(trials, self.of_rule)
        row = {"method": name, "class": class_of(self.methods[name]), "merit": self.methods[name]["merit"],
               "trials": len(trials), "failed": failed, "step": int(trials.budget.max()) if len(trials) else 0,
               "recommended": self.with_bands(recommended, statistics=FINAL_STATISTICS),
               "commanded": self.with_bands(self.last(trials, "commanded"))}
        if len(trials) and not row["recommended"]["n"]:
            row["measured"] = quartiles([values[-1] for values in trials.best])
        row["machine_seconds"] = np.median([seconds[-1] for seconds in trials.until_glued]) if len(trials) else None
        host = [1000 * sum(of) / max(len(of) - 1, 1) for of in trials.host_seconds if of]
        row["algorithm_ms_per_step"] = np.median(host) if host else None
        if trials[GLUED[self.rule] + "centre"].notna().any():
            row["mtf"] = {point: quartiles(trials[GLUED[self.rule] + point].to_numpy()) for point in ("centre", "corner")}
        if self.has_yield(trials, self.rule):
            row["yield"] = self.yield_by(trials, failed, self.rule)
            glued = trials[trials.uncured_mse.notna()]
            if len(glued):
                before = rmse(np.array([uncured[self.rule] for uncured in glued.uncured], dtype=float))
                row["yield"]["uncured"] = yield_of(self.met(glued, before, UNCURED[self.rule]), failed)
            if self.spec is not None:
                row["to_spec"] = self.to_spec(trials, self.rule)
        row["rules"] = {rule: self.by_rule(trials, failed, rule) for rule in RULES}
        if excess := self.excess_after(trials):
            row["excess"] = excess
        if self.rule != "own":
            return row  # records have the true pose of the method's own recommendation alone
        off = [np.abs(np.subtract(end, best)) for end, best in zip(trials.ended_at, trials.own_optimum_pose) if len(best)]
        if off and self.axes:
            off = np.array(off) * [axis["upper"] - axis["lower"] for axis in self.axes]
            row["residual"] = {"axes": [{"median": np.median(one), "q75": np.quantile(one, 0.75)} for one in off.T]}
        return row

    def has_yield(self, trials, rule):
        truth = len(trials) and not np.isnan(ends_of(trials, rule)).all()
        mtf = not self.limits or trials[GLUED[rule] + "centre"].notna().any()
        return self.judges and (not len(trials) or truth and mtf)

    def yield_by(self, trials, failed, rule):
        return yield_of(self.met(trials, ends_of(trials, rule), GLUED[rule]), failed)

    def by_rule(self, trials, failed, rule):
        column = self.last(trials, RULES[rule])
        found = {"n": int((~np.isnan(column)).sum())}
        if not found["n"]:
            return found
        found.update(median=np.nanmedian(column))
        found["lo95"], found["hi95"] = band(column, self.drawn)
        if self.has_yield(trials, rule):
            found["yield"] = self.yield_by(trials, failed, rule)
        if self.spec is not None:
            found["steps"] = self.to_spec(trials, rule)["steps"]
        return found

    def excess_after(self, trials):
        """The errors above the own optimum after some numbers of images, by each rule; empty if none is known."""
        last, found = int(trials.budget.max()) if len(trials) else 0, []
        for images in [*(images for images in EXCESS_IMAGES if images < last), last]:
            found.append({"images": images})
            for rule, track in EXCESS.items():
                column = self.column(trials, [values[min(images, len(values) - 1)] for values in trials[track]])
                found[-1][rule] = self.with_bands(column, RULES[rule] in self.bands_of)
        return found if any(entry[rule]["n"] for entry in found for rule in EXCESS) else []

    def mtf_met(self, trials, of):
        met = np.full(len(trials), True)
        for point, limit in self.limits.items():
            met &= trials[of + point].to_numpy() >= limit
        return met

    def met(self, trials, errors, of):
        return self.mtf_met(trials, of) & ((errors <= self.spec) if self.spec is not None else True)

    def to_spec(self, trials, rule):
        if not len(trials):
            return {"successes": 0, "n": 0, "steps": None, "lo95": None, "hi95": None, "expected": None, "seconds": None}
        there = [arrival(track, self.spec) if sharp else None
                 for track, sharp in zip(trials[RULES[rule]], self.mtf_met(trials, GLUED[rule]))]
        reached = np.array([step is not None for step in there])
        steps = np.array([budget if step is None else step for step, budget in zip(there, trials.budget)])
        clocks = trials.until_glued if rule == "own" else trials.machine  # the way back is that of the own recommendation
        seconds = [np.inf if step is None else clock[step] for step, clock in zip(there, clocks)]
        middle, low, high = kaplan_meier_median(steps, reached)
        return {"successes": int(reached.sum()), "n": len(trials), "steps": middle, "lo95": low, "hi95": high,
                "expected": steps.sum() / reached.sum() if reached.any() else np.inf,
                "seconds": kaplan_meier_median(seconds, reached)[0]}

    def curve(self, name):
        """Quantiles of every track at every step; a trial that ended early keeps its last value."""
        trials, _ = self.by_method[name]
        last = int(trials.budget.max())

        def at(track, step):
            return np.array([values[min(step, len(values) - 1)] for values in trials[track]])

        of_tracks = {}
        for track in TRACKS:
            points = []
            for step in range(last + 1):
                values = at(track, step)
                found = quartiles(values)
                points.append({"median": np.nan, "q25": np.nan, "q75": np.nan, **found,
                               "mean": np.mean(values[~np.isnan(values)]) if found["n"] else np.nan,
                               "lo95": np.nan, "hi95": np.nan})
                if step in band_steps(last) and track in self.bands_of:
                    points[-1]["lo95"], points[-1]["hi95"] = band(self.column(trials, values), self.drawn)
            of_tracks[track] = pd.DataFrame(points).to_dict("list")
        return {"method": name, "trials": len(trials), "first_step": 0, "tracks": of_tracks,
                "machine_seconds": [np.median(at("machine", step)) for step in range(last + 1)]}

    def ecdf(self, name):
        trials, _ = self.by_method[name]
        when = [arrival(track, target) for track in trials[self.of_rule] for target in self.targets]
        steps = np.arange(int(trials.budget.max()) + 1)
        share = np.array([sum(step is not None and step <= by for step in when) / len(when) for by in steps])
        shown = np.append(True, np.diff(share) != 0)
        shown[-1] = True
        return {"method": name, "steps": steps[shown].tolist(), "share": share[shown].tolist()}

    def score(self, name, rule):
        trials, _ = self.by_method[name]
        return np.maximum(self.last(trials, RULES[rule]), RESOLUTION)

    def comparisons(self, rule):
        """The pairs, the method with the lower median first, and Friedman's test."""
        scores = {name: self.score(name, rule) for name, (trials, _) in self.by_method.items() if len(trials)}
        scores = {name: score for name, score in scores.items() if not np.isnan(score).all()}
        ranked = sorted(scores, key=lambda name: np.nanmedian(scores[name]))
        firsts = ranked if len(ranked) <= MOST_COMPARED else ranked[:1]
        classes = [class_of(self.methods[name]) for name in ranked]
        leaders = [name for place, name in enumerate(ranked) if classes[place] not in classes[:place]]

        def compared(a, b):
            same_class = class_of(self.methods[a]) == class_of(self.methods[b])
            return a in firsts or {a, b} in self.contrasts or a in leaders and same_class
        pairs = [self.pair(a, b, scores) for a in ranked for b in ranked[ranked.index(a) + 1:] if compared(a, b)]
        for pair, corrected in zip(pairs, holm([pair["p"] for pair in pairs])):
            pair["p_holm"] = corrected
        planned = [pair for pair in pairs if {pair["a"], pair["b"]} in self.contrasts]
        for pair, corrected in zip(planned, holm([pair["p"] for pair in planned])):
            pair.update(planned=True, p_planned=corrected)
            if yields := self.yields_of(pair["a"], pair["b"], rule):
                pair["yields"] = yields
        with_yields = [pair for pair in planned if "yields" in pair]
        for pair, corrected in zip(with_yields, holm([pair["yields"]["p"] for pair in with_yields])):
            pair["yields"]["p_planned"] = corrected
        found = {"pairs": pairs} if pairs else {}
        if len(ranked) > 2:
            instances, p = friedman([scores[name] for name in ranked])
            found["friedman"] = {"instances": instances, "p": p}
        return found

    def passed(self, name, rule):
        """Whether the trials of a method ended in specification, by instance."""
        trials, _ = self.by_method[name]
        all_of_it = self.trials[self.trials.algorithm == name]
        lenses = pd.Series(False, index=sorted(all_of_it.instance.unique()))
        lenses[trials.instance.to_numpy()] = self.met(trials, ends_of(trials, rule), GLUED[rule])
        return lenses

    def yields_of(self, a, b, rule):
        if not all(self.has_yield(self.by_method[name][0], rule) for name in (a, b)):
            return None
        both = pd.concat([self.passed(a, rule), self.passed(b, rule)], axis=1, join="inner").to_numpy(dtype=bool)
        alone = [int((both[:, 0] & ~both[:, 1]).sum()), int((both[:, 1] & ~both[:, 0]).sum())]
        p = stats.binomtest(min(alone), sum(alone)).pvalue if sum(alone) else 1.0
        return {"n": len(both), "a": int(both[:, 0].sum()), "b": int(both[:, 1].sum()), "a_alone": alone[0],
                "b_alone": alone[1], "p": p}

    def pair(self, a, b, scores):
        differences = np.log(scores[a]) - np.log(scores[b])
        there = differences[~np.isnan(differences)]
        low, high = band(differences, self.drawn, iqm)
        relevant = np.log(self.relevant)
        verdict = ("undecided" if there.size < FEWEST_COMPARED else "better" if high < -relevant else
                   "worse" if low > relevant else "practically equal" if -relevant <= low and high <= relevant else "undecided")
        return {"a": a, "b": b, "n": int(there.size), "ratio": np.exp(iqm(differences[None])[0]), "lo95": np.exp(low),
                "hi95": np.exp(high), "improvement": np.mean((there < 0) + 0.5 * (there == 0)) if there.size else np.nan,
                "p": signed_rank_p(differences), "verdict": verdict}

    def numbers(self):
        lenses = self.trials.dropna(subset=["own"]).drop_duplicates("instance")
        started = self.trials[self.trials.made > 0].drop_duplicates("instance")
        rows = [self.row(name) for name in self.by_method]
        measured_only = any("measured" in row for row in rows) and not any(row["recommended"]["n"] for row in rows)
        rows.sort(key=lambda row: row.get("measured", row["recommended"]).get("median", np.inf))
        finished = [sorted(trials.instance) for trials, _ in self.by_method.values()]
        made = [name for name, (trials, _) in self.by_method.items() if len(trials)]
        group = {"scene": self.scene, "noise_level": self.trials.noise_level.iloc[0], "protocol": self.trials.protocol.iloc[0],
                 "instances": len(self.instances), "same_instances": all(one == finished[0] for one in finished),
                 "start": np.median([values[0] for values in started["measured" if measured_only else "commanded"]]),
                 "rows": rows, "curves": [self.curve(name) for name in made], **self.comparisons(self.rule)}
        if measured_only:
            group["measured_only"] = True
            for row in rows:
                del row["rules"]
        else:
            group["rules"] = {rule: {"pairs": self.comparisons(rule).get("pairs", [])} for rule in RULES}
            group["ecdf"] = [self.ecdf(name) for name in made]
        if len(lenses):
            best = lenses.own.median()
            group["floor"] = {"own_optimum": best}
            if (above := self.trials.dropna(subset=["start_excess"]).drop_duplicates("instance")).size:
                group["start_excess"] = above.start_excess.median()
            if self.excess is not None:
                group["floor"]["next_image"] = np.sqrt(best**2 + self.excess)
        if self.spec is not None:
            group["spec_rmse"] = self.spec
        if self.mtf:
            group["spec_mtf"] = self.mtf
        if self.judges:
            counting = pd.concat([trials for trials, _ in self.by_method.values()])
            misses = counting.own_optimum_mtf_centre.notna() & ~self.mtf_met(counting, "own_optimum_mtf_")
            if self.spec is not None:
                misses |= counting.own > self.spec
            infeasible = set(counting[misses].instance)
            if self.limits:  # the least error need not be the sharpest: what a method brought into spec is not infeasible
                infeasible -= set(counting[self.met(counting, ends_of(counting, self.rule), GLUED[self.rule])].instance)
            group.update(cannot_meet_spec=len(infeasible), infeasible=sorted(int(lens) for lens in infeasible)[:20])
        return group


def aggregates(folder, rule=None):
    """As `aggregate` of the report's JSON. `rule`: of --rule."""
    manifest, trials = read(folder)
    rule = rule or (manifest.get("analysis") or {}).get("rule", "own")
    trials = trials.assign(normalised=trials["normalised_" + rule])
    resamples = 1_000 if len(trials) > 10_000 else 10_000
    classes = {(one.get("of_list", {}).get("method", one["name"]), one["protocol"]): class_of(one)
               for one in manifest["algorithms"]}
    found = [Aggregate(manifest, of, resamples, classes) for _, of in trials.groupby("protocol", sort=False)]
    return [one.numbers() for one in found if one.strata]


def groups(folder, rule=None):
    """As `groups` of the report's JSON, with `mean` in the tracks besides. `rule`: of --rule."""
    manifest, trials = read(folder)
    rule = rule or (manifest.get("analysis") or {}).get("rule", "own")
    many = len(trials) > 10_000
    resamples, bands_of = (1_000, (RULES[rule],)) if many else (10_000, TRACKS)
    return [Group(folder, manifest, of, resamples, bands_of, rule).numbers()
            for _, of in trials.groupby(["scene", "noise_level", "protocol"], sort=False)]
