"""Faults of a log: each takes a sound log and chance, and gives the log as a fault of the machine leaves it.

With each stand words of which a message about it holds one.
"""

import numpy as np


def chosen(log, rng, share):
    rows = len(log["t"])
    return np.sort(rng.choice(rows, max(1, round(share * rows)), replace=False))


def copied(log):
    return {key: value.copy() for key, value in log.items()}


def spikes(channel, joint, share, size):
    def fault(log, rng):
        out, rows = copied(log), chosen(log, rng, share)
        out[channel][rows, joint] += size * rng.choice([-1.0, 1.0], len(rows)) * rng.uniform(0.5, 1.0, len(rows))
        return out

    return fault


def failed_reads(share):
    def fault(log, rng):
        out, rows = copied(log), chosen(log, rng, share)
        for channel in ("q", "dq", "tau"):
            out[channel][rows] = 0.0
        return out

    return fault


def not_numbers(channel, rows):
    """NaN in rows: a share, one alone, or all."""

    def fault(log, rng):
        out = copied(log)
        n = len(log["t"])
        at = {"all": np.arange(n), "one": np.array([n // 2])}.get(rows)
        at = chosen(log, rng, rows) if at is None else at
        if channel == "t":
            out["t"][at] = np.nan
        else:
            out[channel][at, 1] = np.nan
        return out

    return fault


def second_publisher(kind, every):
    """Rows of another publisher between the rows: one that stands still, or says what was commanded earlier."""

    def fault(log, rng):
        rows = np.arange(0, len(log["t"]) - 1, every)
        other = {key: value[rows].copy() for key, value in log.items()}
        other["t"] = other["t"] + 0.37 * (log["t"][1] - log["t"][0])
        other["publisher"][:] = 1
        if kind == "still":
            other["q"][:], other["dq"][:], other["tau"][:] = [0.5, -0.5], 0.0, 0.0
        else:
            earlier = np.maximum(rows - 25, 0)
            other["q"], other["tau"] = log["q"][earlier], 0.9 * log["tau"][earlier]
        both = {key: np.concatenate([log[key], other[key]]) for key in log}
        order = np.argsort(both["t"], kind="stable")
        return {key: value[order] for key, value in both.items()}

    return fault


def clock(change):
    def fault(log, rng):
        out = copied(log)
        out["t"] = change(log["t"].copy(), rng)
        return out

    return fault


def jump(t, by, at=0.5):
    t[int(at * len(t)) :] += by
    return t


def stand(t, rows):
    k = len(t) // 2
    t[k : k + rows] = t[k]
    return t


def repeated_rows(log, rng):
    k = len(log["t"]) // 2
    return {key: np.concatenate([value[: k + 50], value[k:]]) for key, value in log.items()}


def backwards(log, rng):
    out = copied(log)
    out["t"] = log["t"][::-1].copy()
    return out


def swapped_parts(log, rng):
    k = len(log["t"]) // 2
    return {key: np.concatenate([value[k:], value[:k]]) for key, value in log.items()}


def unset_clock(t, rng):
    """The clock was set after 2 s: a year ahead."""
    t[t >= 2.0] += 3.2e7
    return t


def jitter(t, rng):
    return t + rng.uniform(-0.3, 0.3, len(t)) * (t[1] - t[0])


FAULTS = {"sound": (lambda log, rng: copied(log), [])}
for percent in (0.1, 0.3, 1, 3, 10, 20, 40):
    share = percent / 100
    FAULTS[f"spikes of torque, {percent} %"] = (spikes("tau", 1, share, 60.0), ["spike"])
    FAULTS[f"small spikes of torque, {percent} %"] = (spikes("tau", 0, share, 12.0), ["spike"])
    FAULTS[f"spikes of position, {percent} %"] = (spikes("q", 1, share, 0.4), ["spike", "step", "to and fro"])
    FAULTS[f"spikes of velocity, {percent} %"] = (spikes("dq", 0, share, 9.0), ["spike", "velocit"])
    FAULTS[f"reads that failed, {percent} %"] = (failed_reads(share), ["read 0", "failed", "zero", "to and fro"])
for kind in ("still", "earlier"):
    for every in (1, 10):
        words = ["publisher", "spike", "turn", "step", "leaps", "contradict"]
        FAULTS[f"second publisher, {kind}, every {every}"] = (second_publisher(kind, every), words)
for channel in ("q", "dq", "tau", "t"):
    for rows in ("one", 0.01, 0.4, "all"):
        words = ["NaN", "nan", "no number", "not a number", "no finite", "null", "stamp", "time", "lack a channel"]
        FAULTS[f"NaN in {channel}, {rows}"] = (not_numbers(channel, rows), words)
TIME = ["time", "clock", "gap", "row"]
FAULTS |= {
    "clock jumps 100 s ahead": (clock(lambda t, rng: jump(t, 100.0)), TIME),
    "clock jumps 1 s back": (clock(lambda t, rng: jump(t, -1.0)), TIME),
    "clock jumps 100 s back": (clock(lambda t, rng: jump(t, -100.0)), TIME),
    "clock jumps an hour ahead after one row": (clock(lambda t, rng: jump(t, 3600.0, 2 / len(t))), TIME),
    "clock is set after 2 s": (clock(unset_clock), TIME),
    "clock repeats a time": (clock(lambda t, rng: stand(t, 2)), TIME),
    "clock stands for 10 rows": (clock(lambda t, rng: stand(t, 10)), TIME),
    "clock stands for 40 % of the log": (clock(lambda t, rng: stand(t, int(0.4 * len(t)))), TIME),
    "clock stands all the time": (clock(lambda t, rng: 0 * t), TIME),
    "clock runs backwards": (backwards, TIME),
    "halves exchanged": (swapped_parts, TIME),
    "rows written twice": (repeated_rows, TIME),
    "clock of 10 ms": (clock(lambda t, rng: np.floor(t * 100) / 100), TIME),
    "clock jitters by 30 %": (clock(jitter), TIME),
    "clock runs twice as fast": (clock(lambda t, rng: 2 * t), []),
    "times in milliseconds": (clock(lambda t, rng: 1000 * t), TIME),
    "times beyond any clock": (clock(lambda t, rng: t * 1e30), TIME),
    "times before 1970": (clock(lambda t, rng: t - 1e6), TIME),
}
