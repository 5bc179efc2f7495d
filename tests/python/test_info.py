"""Infos whose noise-free RMSE is computed when it is read."""

import copy
import json
import pickle
import unittest
from unittest import mock

from support import make, make_vector, np

from relign_bench._info import Info, Later

STILL = np.full(5, 0.3, np.float32)


class Counted:
    """Counts how often it computes."""

    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return 0.25


def updated(info):
    into = {}
    into.update(info)
    return into


class Dictionary(unittest.TestCase):
    def setUp(self):
        self.counted = Counted()
        self.info = Info(score=1.5, late=Later(self.counted))

    def test_keys_do_not_compute(self):
        self.assertEqual((list(self.info), len(self.info), "late" in self.info, list(self.info.keys())),
                         (["score", "late"], 2, True, ["score", "late"]))
        self.assertEqual((self.info["score"], self.info.get("score"), self.info.get("other", 3)), (1.5, 1.5, 3))
        self.info["episode"] = 7
        self.assertEqual(self.counted.calls, 0)

    def test_every_way_to_read_gives_the_value_and_computes_once(self):
        plain = {"score": 1.5, "late": 0.25}
        readers = {
            "index": lambda info: {"score": 1.5, "late": info["late"]},
            "get": lambda info: {"score": 1.5, "late": info.get("late")},
            "dict": dict, "unpacking": lambda info: {**info}, "items": lambda info: dict(info.items()),
            "values": lambda info: dict(zip(info, info.values())), "or": lambda info: info | {}, "ror": lambda info: {} | info,
            "update": updated, "arguments": lambda info: dict(**info),
            "json": lambda info: json.loads(json.dumps(info)), "repr": lambda info: eval(repr(info)),
            "pickle": lambda info: pickle.loads(pickle.dumps(info)), "copy": lambda info: copy.copy(info).all(),
            "deepcopy": lambda info: copy.deepcopy(info).all(),
            "setdefault": lambda info: {"score": 1.5, "late": info.setdefault("late")},
            "pop": lambda info: {"score": 1.5, "late": info.pop("late")},
            "popitem": lambda info: {"score": 1.5, **dict([info.popitem()])},
        }
        for name, read in readers.items():
            with self.subTest(name):
                counted = Counted()
                self.assertEqual(read(Info(score=1.5, late=Later(counted))), plain)
                self.assertEqual(counted.calls, 1)
        self.assertTrue(self.info == plain and plain == self.info)
        self.assertNotEqual(self.info, {})
        self.assertEqual(self.info, Info(plain))
        self.assertIs(type(pickle.loads(pickle.dumps(self.info))), dict)

    def test_copies_do_not_compute_and_share_the_value(self):
        others = [self.info.copy(), copy.copy(self.info), copy.deepcopy(self.info)]
        self.assertEqual(self.counted.calls, 0)
        self.assertEqual([other["late"] for other in others], [0.25] * 3)
        self.assertEqual(self.info["late"], 0.25)
        self.assertEqual(self.counted.calls, 1)

    def test_missing_keys_are_errors(self):
        with self.assertRaises(KeyError):
            self.info["other"]
        with self.assertRaises(KeyError):
            self.info.pop("other")
        self.assertIsNone(self.info.pop("other", None))


def counting(env):
    batch = env.task.batch
    return mock.patch.object(batch, "noise_free_mse_at", wraps=batch.noise_free_mse_at)


class Environments(unittest.TestCase):
    def test_computes_when_read_and_only_then(self):
        env = make()
        with counting(env) as computed:
            _, info = env.reset(seed=4)
            for _ in range(3):
                info = env.step(STILL)[-1]
            self.assertEqual(computed.call_count, 0)
            value = info["noise_free_error"]
            self.assertIsInstance(value, float)
            self.assertEqual((info["noise_free_error"], computed.call_count), (value, 1))
        mse = env.task.batch.noise_free_mse([0])[0][0]
        self.assertEqual(value, np.sqrt(mse))

    def test_value_does_not_depend_on_when_it_is_read(self):
        early, late = make(max_episode_steps=None), make(max_episode_steps=None)
        values, kept = [], []
        for seed in (4, 5):  # the second episode has another lens
            values.append(early.reset(seed=seed)[1]["noise_free_error"])
            kept.append(late.reset(seed=seed)[1])
            for _ in range(2):
                values.append(early.step(STILL)[-1]["noise_free_error"])
                kept.append(late.step(STILL)[-1])
        self.assertEqual([info["noise_free_error"] for info in reversed(kept)], values[::-1])
        self.assertEqual(len(set(values)), 6)

    def test_switched_off(self):
        self.assertNotIn("noise_free_error", make(noise_free=False).reset(seed=1)[1])
        self.assertNotIn("noise_free_error", make_vector(2, noise_free=False).reset(seed=1)[1])

    def test_vector_computes_when_read_with_the_values_of_single_environments(self):
        vector, single = make_vector(2), make()
        with counting(vector) as computed:
            vector.reset(seed=4)
            infos = vector.step(np.stack([STILL, STILL]))[-1]
            self.assertTrue(infos["_noise_free_error"].all())
            self.assertEqual(computed.call_count, 0)
            values = infos["noise_free_error"]
            self.assertEqual((values.shape, computed.call_count), ((2,), 1))
        single.reset(seed=5)
        self.assertEqual(single.step(STILL)[-1]["noise_free_error"], values[1])

    def test_info_of_an_ended_episode_can_be_read_after_the_next_one_began(self):
        env, plain = (make_vector(2, max_episode_steps=1, autoreset_mode=mode) for mode in ("SameStep", "Disabled"))
        results = []
        for made in (env, plain):
            made.reset(seed=4)
            results.append(made.step(np.stack([STILL, STILL]))[-1])
        final, new = results[0]["final_info"]["noise_free_error"], results[0]["noise_free_error"]
        np.testing.assert_array_equal(final, results[1]["noise_free_error"])
        self.assertTrue((final != new).all())


if __name__ == "__main__":
    unittest.main()
