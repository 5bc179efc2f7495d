"""Our Bayesian optimisation against scikit-optimize, the long form: `python compare_skopt.py FOLDER [--instances 100]`.

Can be stopped and goes on in the same folder.
Not a test; give it an idle machine, because it tells times too.
"""

import argparse
import os

import paired_search

SEARCHES = {
    "skopt GP": {"use": paired_search.SKOPT},
    "skopt RF": {"use": paired_search.SKOPT, "parameters": {"estimator": "RF"}},
    "skopt ET": {"use": paired_search.SKOPT, "parameters": {"estimator": "ET"}},
    "bo-gp": {"use": "bo-gp"},
    # Another number of candidates is another stream of random numbers: what chance alone makes of the comparison.
    "bo-gp again": {"use": "bo-gp", "parameters": {"candidates": 9990}},
    "bo-rf": {"use": "bo-rf"},
    "bo-et": {"use": "bo-et"},
}

PAIRS = (("bo-gp", "skopt GP"), ("bo-gp", "bo-gp again"), ("bo-rf", "skopt RF"), ("bo-et", "skopt ET"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder")
    parser.add_argument("--scene", default="gaussian_spot")
    parser.add_argument("--noise-level", default="rho0", help="gaussian_spot: rho0; relign_od: rho0.25")
    parser.add_argument("--instances", type=int, default=100)
    parser.add_argument("--searches", nargs="+", default=["skopt GP", "bo-gp", "bo-gp again"], choices=list(SEARCHES))
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()

    searches = {name: SEARCHES[name] for name in asked.searches}
    given = paired_search.suite(asked.scene, asked.noise_level, asked.instances, searches)
    trials = paired_search.run(asked.folder, given, asked.workers)
    print(f"{asked.scene}, {asked.noise_level}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}")
    for name in asked.searches:
        times = [1000 * paired_search.proposal_seconds(trials, name, step) for step in (20, 50)]
        print(f"{name:11s} proposal of step 20: {times[0]:8.2f} ms, of step 50: {times[1]:8.2f} ms")
    for ours, theirs in PAIRS:
        if theirs not in searches or ours not in searches:
            continue
        for step in paired_search.STEPS:
            found = [paired_search.best_so_far(trials, name, step) for name in (ours, theirs)]
            difference, low, high = paired_search.median_difference(*found)
            pairs = len(set(found[0]) & set(found[1]))
            print(f"{ours} - {theirs}, step {step}, {pairs} pairs: {difference:+.1%} ({low:+.1%} to {high:+.1%})")


if __name__ == "__main__":
    main()
