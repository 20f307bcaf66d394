"""Pictures of the gallery: docs/effects.py FOLDER

The torque of each effect by its formula, with noise, along a sum of two sines of one joint, over the signal that shows it.
"""

import math
import random
import sys
from pathlib import Path

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 320, 190, 40, 30, 12
STEP, SECONDS, NOISE = 0.01, 40.0, 0.06


def motion():
    rows = []
    for k in range(int(SECONDS / STEP)):
        t = STEP * k
        w1, w2 = 0.9, 2.17
        q = 0.8 * math.sin(w1 * t) + 0.25 * math.sin(w2 * t)
        v = 0.8 * w1 * math.cos(w1 * t) + 0.25 * w2 * math.cos(w2 * t)
        a = -0.8 * w1 * w1 * math.sin(w1 * t) - 0.25 * w2 * w2 * math.sin(w2 * t)
        rows.append((t, q, v, a))
    return rows


def sign(x):
    return (x > 0) - (x < 0)


def curves(rows):
    """Name, signal, and points of signal and torque."""
    load = [9.0 * math.cos(q) + 1.2 * a for _, q, _, a in rows]
    friction = [sign(v) + 0.5 * v for _, _, v, _ in rows]
    v = [row[2] for row in rows]
    q = [row[1] for row in rows]
    t = [row[0] for row in rows]
    # ways since the last reversal, with their direction
    way, since, last = [], 0.0, 0
    for speed in v:
        since = 0.0 if sign(speed) != last else since + abs(speed) * STEP
        last = sign(speed)
        way.append(last * since)
    far, h, gap, bristle = q[0], 0.0, [], []
    for position, speed in zip(q, v):
        before = far
        far = min(max(before, position - 0.06), position + 0.06)
        gap.append(-sign(speed) if far == before else 0.0)
        h = sign(speed) + (h - sign(speed)) * math.exp(-abs(speed) * STEP / 0.12)
        bristle.append(h - sign(speed))
    spring, rate = [], 0.0
    x = q[0]
    for position, (_, _, _, a) in zip(q, rows):
        rate += STEP * (400.0 * (position - x) - 1.6 * rate)
        x += STEP * rate
        spring.append(25.0 * (position - x) - 0.06 * a)
    late = 8
    delayed = [load[k] - load[max(0, k - late)] for k in range(len(load))]
    return [
        ("smooth-coulomb", "speed", [(x, math.tanh(x / 0.25) - sign(x)) for x in v]),
        ("stribeck", "speed", [(x, sign(x) * math.exp(-((x / 0.2) ** 2))) for x in v]),
        ("nonlinear-viscous", "speed", [(x, 0.6 * sign(x) * abs(x) ** 2 - 0.55 * x) for x in v]),
        ("asymmetric-friction", "speed", [(x, (0.7 + 0.2 * x) * (x > 0) - 0.4) for x in v]),
        ("load-friction", "load", [(x, 0.09 * abs(x) * sign(s)) for x, s in zip(load, v)]),
        ("ripple", "position", [(x, math.sin(14 * x) + 0.3 * math.cos(28 * x)) for x in q]),
        ("position-friction", "position", [(x, sign(s) * (0.8 + 0.6 * math.sin(4 * x))) for x, s in zip(q, v)]),
        ("spring", "position", [(x, 0.9 * x + 0.5 * x**3) for x in q]),
        ("backlash", "way since the last reversal", list(zip(way, gap))),
        ("presliding", "way since the last reversal", list(zip(way, bristle))),
        ("elasticity", "time", [p for p in zip(t, spring) if p[0] > 20]),
        ("delay", "acceleration", [(row[3], d) for row, d in zip(rows, delayed)]),
        ("gain", "load", [(x, 0.12 * x) for x in load]),
        ("warm-up", "time", [(x, f * (0.8 * math.exp(-x / 15.0))) for x, f in zip(t, friction)]),
    ]


def picture(name, signal, points, dots, chance):
    points = [(x, y + chance.gauss(0.0, NOISE)) for x, y in points]
    kept = chance.sample(range(len(points)), min(dots, len(points)))
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    low, high, most = min(xs), max(xs), max(map(abs, ys)) * 1.05
    right, top, foot = WIDTH - 10, TOP, HEIGHT - BOTTOM

    def place(x, y):
        across = LEFT + (right - LEFT) * (x - low) / (high - low)
        return across, 0.5 * (top + foot) - 0.5 * (foot - top) * y / most

    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'role="img" font-family="Helvetica, Arial, \'DejaVu Sans\', sans-serif" font-size="11">',
        f"<title>residual of {name} over {signal}</title>",
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        f'<rect x="{LEFT}" y="{top}" width="{right - LEFT}" height="{foot - top}" fill="none" stroke="#9a9a9a"/>',
    ]
    if low < 0 < high:
        x = place(0.0, 0.0)[0]
        out.append(f'<path d="M{x:.1f} {top}V{foot}" stroke="#bdbdbd"/>')
    middle = 0.5 * (top + foot)
    out.append(f'<path d="M{LEFT} {middle:.1f}H{right}" stroke="#bdbdbd"/>')
    for k in sorted(kept):
        x, y = place(*points[k])
        # forward and backward apart
        forward = "#0072b2" if k in DIRECTION else "#d55e00"
        out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="{forward}"/>')
    out += [
        f'<text x="{0.5 * (LEFT + right)}" y="{HEIGHT - 9}" text-anchor="middle">{signal}</text>',
        f'<text transform="translate(16 {middle:.0f}) rotate(-90)" text-anchor="middle">residual</text>',
        "</svg>",
        "",
    ]
    return "\n".join(out)


DIRECTION = set()


def main():
    rows = motion()
    DIRECTION.update(k for k, row in enumerate(rows) if row[2] > 0)
    folder = Path(sys.argv[1])
    for name, signal, points in curves(rows):
        chance = random.Random(name)
        text = picture(name, signal, points, 420, chance)
        (folder / f"effect_{name}.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
